#include "board.h"

#include "protocol.h"
#include "report.h"

namespace hil {

namespace {

constexpr uint32_t LATE_US = TICK_US + TICK_US / 2;

bool drives(const Board& b) { return b.safety.state == HIL_STATE_ARMED; }

int32_t counts_of(const BoardInputs& in, uint8_t side) {
  return side == LEFT ? in.counts_left : in.counts_right;
}

// Counts moved since the last tick, bounded to 16 bits.
int16_t moved(const Board& b, const BoardInputs& in, uint8_t side) {
  const uint32_t now = static_cast<uint32_t>(counts_of(in, side));
  const int32_t step = static_cast<int32_t>(now - static_cast<uint32_t>(counts_of(b.inputs, side)));
  if (step > INT16_MAX) return INT16_MAX;
  return step < -INT16_MAX ? -INT16_MAX : static_cast<int16_t>(step);
}

// The first snapshot sets the zero of everything that counts differences.
void first_tick(Board& b, const BoardInputs& in) {
  b.ticked = true;
  b.inputs = in;
  b.inputs.t_us = in.t_us - TICK_US;
  safety_init(b.safety, in.encoder_faults);
  for (uint8_t i = 0; i < SIDES; ++i) wheel_init(b.wheel[i], b.tuning, counts_of(in, i));
}

SafetyView sense(Board& b, const BoardInputs& in) {
  if (!b.ticked) first_tick(b, in);
  if (in.t_us - b.inputs.t_us > LATE_US) count_up(b.overruns);
  SafetyView view;
  for (uint8_t i = 0; i < SIDES; ++i) {
    const float asked = drives(b) ? b.setpoint.omega_rad_s[i] : 0.0f;
    view.side[i] = {asked, b.wheel[i].pwm, moved(b, in, i), 0.0f};
  }
  view.illegal_total = in.encoder_faults;
  view.battery_mv = in.battery_mv;
  view.setpoint_age_us = in.t_us - b.setpoint.t_us;
  b.inputs = in;
  return view;
}

void estimate(Board& b, SafetyView& view) {
  for (uint8_t i = 0; i < SIDES; ++i) {
    wheel_estimate(b.wheel[i], b.tuning, counts_of(b.inputs, i));
    view.side[i].omega_rad_s = b.wheel[i].omega_rad_s;
  }
}

void check(Board& b, const SafetyView& view) {
  if (safety_apply(b.safety, safety_check(b.safety, b.limits, view))) say_state(b);
}

void control(Board& b) {
  if (!drives(b)) return;
  const float* const asked = b.setpoint.omega_rad_s;
  const float turn = wheel_turn_duty(b.tuning, asked[RIGHT] - asked[LEFT]);
  wheel_control(b.wheel[LEFT], b.tuning, asked[LEFT], -turn);
  wheel_control(b.wheel[RIGHT], b.tuning, asked[RIGHT], turn);
}

void limit(Board& b) {
  if (!drives(b)) return;
  for (uint8_t i = 0; i < SIDES; ++i) wheel_limit(b.wheel[i], b.tuning);
}

// The gate: whatever the loops say, a board that is not armed has its bridges off.
void actuate(Board& b, BoardOutputs& out) {
  if (!drives(b)) {
    wheel_off(b.wheel[LEFT]);
    wheel_off(b.wheel[RIGHT]);
  }
  out = {b.wheel[LEFT].pwm, b.wheel[RIGHT].pwm};
}

void refuse_frame(Board& b, Text why) {
  count_up(b.link.bad);
  say(b, why);
}

// A good frame has come: it is acted on, waits for the check of its signature, or is refused. True when that
// was costly or is not over.
bool take_frame(Board& b, uint32_t t_us) {
  Link& link = b.link;
  Signer& signer = link.signer;
  const bool is_signed = (link.rx.incompat_flags & MAVLINK_IFLAG_SIGNED) != 0;
  const bool sets_key = link.rx.msgid == MAVLINK_MSG_ID_SETUP_SIGNING;  // whoever has the cable may
  if (sets_key || (signer.mode == Signing::OFF && !is_signed)) return protocol_handle(b, t_us);
  if (signer.mode == Signing::OFF) {
    refuse_frame(b, Text::SIGNED_NO_KEY);
  } else if (signer.mode == Signing::LOCKED || !is_signed) {
    refuse_frame(b, Text::SIGNED_NOT);
  } else if (!signer_is_new(signer, link_sender(link))) {
    refuse_frame(b, Text::SIGNED_OLD);
  } else {
    signer.waiting = true;
    signer.arrived_us = t_us;
  }
  return signer.waiting;
}

void act_on_checked(Board& b) {
  Signer& signer = b.link.signer;
  signer.job = HashJob::NONE;
  signer.waiting = false;
  // One that lies too far ahead comes again: its sender's stamp is stored first.
  if (signer_take(signer, link_sender(b.link))) protocol_handle(b, signer.arrived_us);
}

bool store_signing(Board& b, StoredByte& out) {
  Signer& signer = b.link.signer;
  if (signer_store(signer, out)) return true;
  if (!signer.key_written) return false;
  signer.key_written = false;
  say(b, signer.mode == Signing::ON ? Text::KEY_SET : Text::KEY_CLEARED);
  return false;
}

}  // namespace

void board_init(Board& b) {
  b = Board{};
  link_init(b.link);
  params_defaults(b.params);
  b.default_hash = b.parameter_hash = params_hash(b.params);
  b.dialect_hash = dialect_hash();
  b.params_next = PARAM_COUNT;
  protocol_retune(b);
  safety_init(b.safety, 0);
}

uint16_t board_receive(Board& b, const uint8_t* bytes, uint16_t n, uint32_t t_us) {
  for (uint16_t i = 0; i < n; ++i) {
    if (b.link.signer.waiting) return i;
    if (link_take(b.link, bytes[i]) && take_frame(b, t_us)) return static_cast<uint16_t>(i + 1);
  }
  return n;
}

void board_tick(Board& b, const BoardInputs& in, BoardOutputs& out) {
  SafetyView view = sense(b, in);
  estimate(b, view);
  check(b, view);
  control(b);
  limit(b);
  actuate(b, out);
  signer_tick(b.link.signer);
  report_tick(b);
}

bool board_idle(Board& b) {
  Signer& signer = b.link.signer;
  if (signer.job == HashJob::NONE && !link_begin_hash(b.link)) return false;
  const HashJob job = signer.job;
  if (job == HashJob::ACT) {
    act_on_checked(b);
    return true;
  }
  uint8_t signature[SIGNATURE_SIZE];
  if (!signer_slice(signer, signature)) return true;
  if (job == HashJob::SIGN) {
    link_signed(b.link, signature);
  } else if (link_checked(b.link, signature)) {
    signer.job = HashJob::ACT;  // in a call of its own: a tick may be due
  } else {
    refuse_frame(b, Text::SIGNED_OTHERWISE);
  }
  return true;
}

bool board_hashes(const Board& b) { return b.link.signer.waiting || b.link.tx.ready != b.link.tx.head; }

uint32_t board_heard(const Board& b) {
  return b.link.signer.mode == Signing::OFF ? b.link.received : b.link.signer.heard;
}

void board_slack(Board& b) {
  if (b.retune_wait > 0) --b.retune_wait;
  if (b.retune_due && (b.retune_wait == 0 || !drives(b))) protocol_retune(b);
}

uint16_t board_transmit(Board& b, uint8_t* out, uint16_t max) { return ring_take(b.link.tx, out, max); }

ImageResult board_load(Board& b, StorageRead read, void* storage) {
  const Stored stored = save_load(b.save, b.params, read, storage);
  b.parameter_hash = params_hash(b.params);
  protocol_retune(b);
  if (stored.result == ImageResult::DAMAGED) say(b, Text::STORAGE_DAMAGED);
  if (stored.older) say(b, Text::STORAGE_OLD);
  if (signer_load(b.link.signer, read, storage)) say(b, Text::KEY_DAMAGED);
  return stored.result;
}

bool board_store(Board& b, StoredByte& out) {
  Save& s = b.save;
  if (s.running) {
    if (save_next(s, out)) return true;
    save_end(s);
    if (!s.wanted) protocol_acknowledge(b, MAV_CMD_PREFLIGHT_STORAGE, MAV_RESULT_ACCEPTED);
  }
  if (!s.wanted) return store_signing(b, out);
  save_begin(s, b.params);
  return save_next(s, out);
}

}  // namespace hil
