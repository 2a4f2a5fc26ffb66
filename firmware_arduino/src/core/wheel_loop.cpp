#include "fast.h"

#include "wheel_loop.h"

#include <math.h>

#include "constants.h"
#include "flt.h"

namespace hil {

namespace {

constexpr float TWO_PI_RAD = 6.2831853f;

// Share a first-order low-pass takes of a new value per tick (backward Euler).
float blend(float tau_s) { return TICK_S / (tau_s + TICK_S); }

Demand demand_of(const WheelTuning& t, float setpoint_rad_s, float turn_duty) {
  const float coulomb = clamp(setpoint_rad_s * t.ff_inv_dead_s_rad, 1.0f);
  return {setpoint_rad_s, t.ff_duty_s_rad * setpoint_rad_s + t.ff_dead_duty * coulomb + turn_duty, turn_duty,
          fabsf(setpoint_rad_s) <= t.hold_setpoint_rad_s};
}

// e and its filtered derivative; every law and telemetry use them.
void track_error(Wheel& w, const WheelTuning& t) {
  w.error_rad_s = w.omega_rad_s - w.demand.setpoint_rad_s;
  if (w.start == Start::ANEW) w.error_lag_rad_s = w.error_rad_s;
  const float lead = w.error_rad_s - w.error_lag_rad_s;
  w.error_rate_rad_s2 = lead * t.inv_error_rate_tau_1_s;
  w.error_lag_rad_s += t.error_rate_blend * lead;
}

// The law in force, of a pair of functions each law has (laws.def).
float law_step(Wheel& w, const WheelTuning& t) {
  switch (t.law) {
#define WHEEL_LAW(ID, files, name, doc) \
  case Law::ID: return wheel_##files::step(w.files, t.files, w);
#include "laws.def"
#undef WHEEL_LAW
  }
  return 0.0f;
}

bool law_stepped(const Wheel& w, const WheelTuning& t, float setpoint_rad_s) {
  switch (t.law) {
#define WHEEL_LAW(ID, files, name, doc) \
  case Law::ID: return wheel_##files::stepped(w.files, t.files, setpoint_rad_s);
#include "laws.def"
#undef WHEEL_LAW
  }
  return false;
}

void laws_forget(Wheel& w) {
#define WHEEL_LAW(ID, files, name, doc) wheel_##files::forget(w.files);
#include "laws.def"
#undef WHEEL_LAW
}

// A new set-point; so far from where the law last started that it starts anew, it is a step.
void take_setpoint(Wheel& w, const WheelTuning& t, float setpoint_rad_s, float turn_duty) {
  w.demand = demand_of(t, setpoint_rad_s, turn_duty);
  w.fresh = true;
  if (w.start == Start::RUNNING && law_stepped(w, t, setpoint_rad_s)) w.start = Start::STEPPED;
}

// Offset that makes up for the integrals that have just begun anew.
float transfer(const Wheel& w, float law) {
  if (w.start == Start::RETUNED) return w.duty - w.demand.forward_duty - law;
  if (w.start == Start::STEPPED) return clamp(w.feedback_duty - law, 1.0f);
  return w.start == Start::ANEW ? 0.0f : w.bump_duty;
}

}  // namespace

WheelTuning wheel_tuning(const Params& p) {
  WheelTuning t;
  t.rad_per_count = TWO_PI_RAD / p.enc_counts_per_turn;
  t.st = super_twisting_gains(static_cast<Scheme>(static_cast<uint8_t>(p.st_scheme)), p.st_l_rad_s2, p.st_l0,
                              p.st_l1, p.st_cell_counts * t.rad_per_count, TICK_S);
  if (p.st_variable >= 1.0f) {
    super_twisting_vary(t.st, p.st_l_min_rad_s2, p.st_rho_1_s, p.st_alpha);
  }
  t.omega_blend = blend(p.omega_tau_s);
  t.error_rate_blend = blend(p.error_rate_tau_s);
  t.inv_error_rate_tau_1_s = 1.0f / (p.error_rate_tau_s + TICK_S);
  t.ff_duty_s_rad = p.ff_duty_s_rad;
  t.ff_dead_duty = p.ff_dead_duty;
  t.ff_inv_dead_s_rad = 1.0f / p.ff_dead_rad_s;
  t.ff_turn_duty = p.ff_turn_duty;
  t.ff_inv_turn_s_rad = 1.0f / p.ff_turn_rad_s;
  t.hold_setpoint_rad_s = p.hold_setpoint_rad_s;
  t.hold_omega_rad_s = p.hold_omega_rad_s;
  t.law = static_cast<Law>(static_cast<uint8_t>(p.law));
  t.bump_keep = 1.0f - blend(p.bump_tau_s);
#define WHEEL_LAW(ID, files, name, doc) t.files = wheel_##files::tuning(p);
#include "laws.def"
#undef WHEEL_LAW
  t.pwm_max_counts = static_cast<int16_t>(p.pwm_max_duty * PWM_TOP);
  const float slew = p.pwm_slew_duty_s * TICK_S * PWM_TOP;
  t.slew_counts = slew > 2.0f * PWM_TOP ? 2 * PWM_TOP : static_cast<int16_t>(slew);
  return t;
}

void wheel_init(Wheel& w, const WheelTuning& t, int32_t counts) {
  w = Wheel{};
  w.last_counts = counts;
  super_twisting_reset(w.st, t.st);
  wheel_off(w);
}

void wheel_estimate(Wheel& w, const WheelTuning& t, int32_t counts) {
  // Through unsigned: the difference stays right when the counter wraps.
  const int32_t moved =
      static_cast<int32_t>(static_cast<uint32_t>(counts) - static_cast<uint32_t>(w.last_counts));
  w.last_counts = counts;
  const float raw = super_twisting_step(w.st, t.st, static_cast<float>(moved) * t.rad_per_count);
  w.omega_rad_s += t.omega_blend * (raw - w.omega_rad_s);
}

float wheel_turn_duty(const WheelTuning& t, float faster_rad_s) {
  if (is_zero(t.ff_turn_duty)) return 0.0f;
  return t.ff_turn_duty * clamp(faster_rad_s * t.ff_inv_turn_s_rad, 1.0f);
}

void wheel_control(Wheel& w, const WheelTuning& t, float setpoint_rad_s, float turn_duty) {
  w.fresh = false;
  if (setpoint_rad_s != w.demand.setpoint_rad_s || turn_duty != w.demand.turn_duty ||
      w.start != Start::RUNNING) {
    take_setpoint(w, t, setpoint_rad_s, turn_duty);
  }
  w.holding = w.demand.zero && fabsf(w.omega_rad_s) <= t.hold_omega_rad_s;
  if (w.holding) {
    wheel_off(w);
    return;
  }
  if (w.start == Start::RETUNED) laws_forget(w);
  track_error(w, t);
  const float law = law_step(w, t);
  w.bump_duty = transfer(w, law);
  w.feedback_duty = law + w.bump_duty;
  w.duty = w.demand.forward_duty + w.feedback_duty;
  w.bump_duty *= t.bump_keep;
  w.start = Start::RUNNING;
}

void wheel_limit(Wheel& w, const WheelTuning& t) {
  constexpr float FAR = 4.0f;  // within int16 whatever the law says
  const float duty = fabsf(w.duty) <= FAR ? w.duty : clamp(w.duty, FAR);
  int16_t pwm = static_cast<int16_t>(lroundf(duty * PWM_TOP));
  const int16_t asked = pwm;
  if (pwm > w.pwm + t.slew_counts) pwm = static_cast<int16_t>(w.pwm + t.slew_counts);
  if (pwm < w.pwm - t.slew_counts) pwm = static_cast<int16_t>(w.pwm - t.slew_counts);
  if (pwm > t.pwm_max_counts) pwm = t.pwm_max_counts;
  if (pwm < -t.pwm_max_counts) pwm = static_cast<int16_t>(-t.pwm_max_counts);
  w.saturation = static_cast<int8_t>((asked > pwm) - (asked < pwm));
  w.pwm = pwm;
}

float wheel_sliding(const Wheel& w, const WheelTuning& t) {
  switch (t.law) {
#define WHEEL_LAW(ID, files, name, doc) \
  case Law::ID: return wheel_##files::sliding(w.files);
#include "laws.def"
#undef WHEEL_LAW
  }
  return 0.0f;
}

void wheel_off(Wheel& w) {
  w.start = Start::ANEW;
  w.duty = 0.0f;
  w.pwm = 0;
  w.feedback_duty = w.bump_duty = 0.0f;
  w.error_rate_rad_s2 = 0.0f;
  w.saturation = 0;
  laws_forget(w);
}

void wheel_retuned(Wheel& w) {
  if (w.start == Start::RUNNING) w.start = Start::RETUNED;
}

}  // namespace hil
