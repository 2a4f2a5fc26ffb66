#include "fast.h"

#include "safety.h"

#include <math.h>

namespace hil {

namespace {

// The fault rows stand before the arming rows, so nothing arms while a fault holds.
constexpr SafetyRule RULES[] = {
    {HIL_STATE_ARMED, ANY_FAULT, HIL_STATE_SAFE},
    {HIL_STATE_ARMED, WANTS_DISARM, HIL_STATE_DISARMED},
    {HIL_STATE_DISARMED, condition(HIL_REASON_STOP_COMMAND), HIL_STATE_SAFE},
    {HIL_STATE_DISARMED, ANY_FAULT | WANTS_DISARM, HIL_STATE_DISARMED},
    {HIL_STATE_DISARMED, WANTS_ARM, HIL_STATE_ARMED},
    {HIL_STATE_SAFE, ANY_FAULT | WANTS_DISARM, HIL_STATE_SAFE},
    {HIL_STATE_SAFE, WANTS_ARM, HIL_STATE_ARMED},
};

constexpr uint8_t WINDOW_TICKS = 250;  // one second
constexpr float TICKS_PER_MS = 1000.0f / TICK_US;
constexpr float TWO_PI_RAD = 6.2831853f;
// Slower than this a wheel is asked to creep: tyres that scrub while the robot turns on the spot may hold it for
// long at half the duty and more, so that it is a stall only from so much more duty on.
constexpr float CRAWL_RAD_S = 0.5f;
constexpr float CREEPING_DUTY_RATIO = 1.5f;

// Counts ticks in a row; true once `limit` is reached.
bool lasts(uint16_t& ticks, bool holds, uint16_t limit) {
  if (!holds) {
    ticks = 0;
  } else if (ticks < limit) {
    ++ticks;
  }
  return holds && ticks >= limit;
}

void fade(Tally& t) {
  if (t.remembered == 0 || (++t.fade & 7u) != 0) return;
  --t.remembered;
}

// As lasts(); besides, times of at least `worth` ticks add up.
bool adds_up(Tally& t, bool holds, uint16_t limit, uint16_t worth) {
  if (!holds) {
    if (t.ticks >= worth) t.remembered = static_cast<uint16_t>(t.remembered + t.ticks);
    t.ticks = 0;
    return false;
  }
  if (t.ticks < limit) ++t.ticks;
  const bool again = t.ticks >= worth && t.ticks + t.remembered >= limit;
  if (t.ticks < limit && !again) return false;
  t.remembered = 0;
  return true;
}

bool against(const SideView& v) { return (v.pwm > 0) == (v.moved_counts < 0); }

// A wheel with counts neither way keeps its tally: at a crawl most ticks see no count. A sound wheel that is
// reversed runs against its duty for 40 ms.
bool runs_away(Tally& t, const SideView& v, const SafetyLimits& limits) {
  const bool pushed = v.pwm >= limits.runaway_pwm || v.pwm <= -limits.runaway_pwm;
  fade(t);
  if (pushed && v.moved_counts == 0) return false;
  const bool lost =
      pushed && against(v) && fabsf(v.omega_rad_s - v.setpoint_rad_s) >= limits.runaway_error_rad_s;
  return adds_up(t, lost, limits.runaway_ticks, limits.runaway_ticks / 3);
}

// Whether the wheel has got on by two counts, either way, since it last did.
bool gets_on(int16_t& net_counts, int16_t moved_counts) {
  constexpr int16_t FLICKER_COUNTS = 1;
  if (moved_counts > FLICKER_COUNTS || moved_counts < -FLICKER_COUNTS) return true;
  net_counts = static_cast<int16_t>(net_counts + moved_counts);
  return net_counts > FLICKER_COUNTS || net_counts < -FLICKER_COUNTS;
}

bool stalls(Tally& t, int16_t& net_counts, const SideView& v, const SafetyLimits& limits) {
  const float asked_rad_s = fabsf(v.setpoint_rad_s);
  const int16_t high_pwm = asked_rad_s < CRAWL_RAD_S ? limits.stall_creeping_pwm : limits.stall_pwm;
  const bool pushed = v.pwm >= high_pwm || v.pwm <= -high_pwm;
  const bool asked = asked_rad_s >= limits.stall_setpoint_rad_s;
  const bool on = gets_on(net_counts, v.moved_counts);
  const bool driven = pushed || asked;
  fade(t);
  if (on || !driven) net_counts = 0;
  if (!on && !driven) t.ticks = 0;  // nobody asks: that says nothing about the encoder
  return adds_up(t, driven && !on, limits.stall_ticks, limits.pause_ticks);
}

void check_battery(Safety& s, const SafetyLimits& limits, uint16_t battery_mv) {
  if (s.battery_low) {
    s.battery_low = battery_mv < limits.battery_good_mv;
    s.battery_ticks = 0;
  } else {
    s.battery_low = lasts(s.battery_ticks, battery_mv < limits.battery_low_mv, limits.battery_ticks);
  }
}

// A fault stands from the moment the window's share is used up to the end of the next clean window.
void check_encoder(Safety& s, const SafetyLimits& limits, uint16_t illegal_total) {
  const bool over = static_cast<uint16_t>(illegal_total - s.illegal_at_window) > limits.illegal_per_s;
  if (over) s.encoder_fault = true;
  if (++s.window_ticks >= WINDOW_TICKS) {
    s.encoder_fault = over;
    s.illegal_at_window = illegal_total;
    s.window_ticks = 0;
  }
}

// A pause of a sound wheel between two counts, and the start of one against friction, are shorter than this.
float pause_ticks(const Params& p) {
  constexpr float START_TICKS = 25.0f;
  const float two_counts = 2.0f * TWO_PI_RAD / (p.enc_counts_per_turn * CRAWL_RAD_S * TICK_S);
  return fmaxf(fmaxf(START_TICKS, two_counts), 0.25f * p.stall_ms * TICKS_PER_MS);
}

uint16_t ticks_of(float ms) { return static_cast<uint16_t>(ms * TICKS_PER_MS + 0.5f); }

}  // namespace

uint8_t safety_next(uint8_t state, Conditions conditions) {
  for (const SafetyRule& rule : RULES) {
    if (rule.state == state && (rule.any_of & conditions) != 0) return rule.next;
  }
  return state;
}

uint8_t safety_reason(Conditions conditions) {
  for (uint8_t reason = HIL_REASON_NONE + 1; reason < HIL_REASON_ENUM_END; ++reason) {
    if ((conditions & condition(reason)) != 0) return reason;
  }
  return HIL_REASON_NONE;
}

SafetyLimits safety_limits(const Params& p) {
  SafetyLimits l;
  l.setpoint_age_us = static_cast<uint32_t>(p.setpoint_timeout_ms * 1000.0f) - TICK_US;
  l.battery_low_mv = static_cast<uint16_t>(p.battery_low_v * 1000.0f + 0.5f);
  l.battery_good_mv = p.battery_low_v > 0.0f
                          ? static_cast<uint16_t>((p.battery_low_v + p.battery_hysteresis_v) * 1000.0f + 0.5f)
                          : 0;
  l.battery_ticks = ticks_of(p.battery_debounce_ms);
  l.stall_ticks = ticks_of(p.stall_ms);
  l.pause_ticks = static_cast<uint16_t>(pause_ticks(p));
  l.runaway_ticks = ticks_of(p.runaway_ms);
  l.overspeed_ticks = ticks_of(p.overspeed_ms);
  l.stall_pwm = static_cast<int16_t>(p.stall_duty * PWM_TOP);
  l.stall_creeping_pwm = static_cast<int16_t>(CREEPING_DUTY_RATIO * p.stall_duty * PWM_TOP);
  l.runaway_pwm = static_cast<int16_t>(p.runaway_duty * PWM_TOP);
  l.stall_setpoint_rad_s = p.stall_setpoint_rad_s;
  l.runaway_error_rad_s = p.runaway_error_rad_s;
  l.overspeed_rad_s = p.overspeed_rad_s;
  l.illegal_per_s = static_cast<uint16_t>(p.illegal_per_s);
  l.edges_too_fast = p.enc_counts_per_turn * p.overspeed_rad_s > ENCODER_COUNTS_1_S * TWO_PI_RAD;
  return l;
}

void safety_init(Safety& s, uint16_t illegal_total) {
  s = Safety{};
  s.state = HIL_STATE_DISARMED;
  s.illegal_at_window = illegal_total;
}

Conditions safety_check(Safety& s, const SafetyLimits& limits, const SafetyView& view) {
  Conditions now = 0;
  for (uint8_t i = 0; i < SIDES; ++i) {
    const SideView& side = view.side[i];
    const bool fast = fabsf(side.omega_rad_s) > limits.overspeed_rad_s;
    if (runs_away(s.runaway[i], side, limits)) now |= condition(HIL_REASON_RUNAWAY_LEFT + i);
    if (lasts(s.overspeed_ticks[i], fast, limits.overspeed_ticks)) {
      now |= condition(HIL_REASON_OVERSPEED_LEFT + i);
    }
    if (stalls(s.stall[i], s.net_counts[i], side, limits)) now |= condition(HIL_REASON_STALL_LEFT + i);
  }
  check_encoder(s, limits, view.illegal_total);
  check_battery(s, limits, view.battery_mv);
  if (s.encoder_fault) now |= condition(HIL_REASON_ENCODER);
  if (s.battery_low) now |= condition(HIL_REASON_BATTERY_LOW);
  s.standing = now;
  if (s.state == HIL_STATE_ARMED && view.setpoint_age_us > limits.setpoint_age_us) {
    now |= condition(HIL_REASON_SETPOINT_TIMEOUT);
  }
  return now;
}

bool safety_apply(Safety& s, Conditions conditions) {
  const uint8_t next = safety_next(s.state, conditions);
  if (next == s.state) return false;
  s.state = next;
  s.reason = safety_reason(conditions);
  return true;
}

}  // namespace hil
