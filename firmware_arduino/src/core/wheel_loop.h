// One side's wheels: speed from the encoder, a wheel law of docs/wheel-loop.md, limits.
// Signs: positive duty, PWM and speed drive forward and make counts rise. Duty is a ratio, -1 to 1.
#ifndef HIL_CORE_WHEEL_LOOP_H
#define HIL_CORE_WHEEL_LOOP_H

#include <stdint.h>

#include "super_twisting.h"
#include "wheel_laws.h"

namespace hil {

// Everything a tick needs of the parameters, divided and rooted beforehand; shared by both sides.
struct WheelTuning {
  SuperTwistingGains st;
  float rad_per_count;
  float omega_blend;  // share of a new value the speed filter takes per tick
  float error_rate_blend;
  float inv_error_rate_tau_1_s;
  float ff_duty_s_rad, ff_dead_duty, ff_inv_dead_s_rad;
  float ff_turn_duty, ff_inv_turn_s_rad;
  float hold_setpoint_rad_s, hold_omega_rad_s;
  Law law;
#define WHEEL_LAW(ID, files, name, doc) wheel_##files::Tuning files;
#include "laws.def"
#undef WHEEL_LAW
  float bump_keep;  // share of the transfer offset left after one tick
  int16_t pwm_max_counts, slew_counts;
};

WheelTuning wheel_tuning(const Params& params);

struct Wheel : Tracked {
  int32_t last_counts;
  SuperTwisting st;
#define WHEEL_LAW(ID, files, name, doc) wheel_##files::State files;
#include "laws.def"
#undef WHEEL_LAW
  float feedback_duty;  // law plus transfer offset, without feed-forward
  float duty;           // wanted, before the limits
  float bump_duty;      // transfer offset, decays
  bool holding;         // zero set-point and slow: bridge off
  int16_t pwm;          // applied, -PWM_TOP to PWM_TOP
};

void wheel_init(Wheel& w, const WheelTuning& t, int32_t counts);
// Speed from the counts of this tick. Float operations, division and root as four: 20; 2,500 cycles on
// the ATmega2560.
void wheel_estimate(Wheel& w, const WheelTuning& t, int32_t counts);
// What a side's feed-forward has of the turn (2.33): `faster_rad_s` is how much its set-point is above the
// other side's.
float wheel_turn_duty(const WheelTuning& t, float faster_rad_s);
// Wanted duty for the set-point; `turn_duty` is of the tick in which the set-points came. Float operations: ASG-ISM 38 (while eps(t) still falls 46), PID 18; on
// a new set-point 8 more. ASG-ISM takes 6,500 cycles.
void wheel_control(Wheel& w, const WheelTuning& t, float setpoint_rad_s, float turn_duty);
// Rounds to PWM counts, limits range and slew, notes saturation. Float operations: 4; 700 cycles.
void wheel_limit(Wheel& w, const WheelTuning& t);
// Sliding variable of the law in force, for the telemetry; 0 where it has none.
float wheel_sliding(const Wheel& w, const WheelTuning& t);
// Bridge off at once, law ready to start anew.
void wheel_off(Wheel& w);
// Law or gains have changed: the output of a running wheel continues where it is.
void wheel_retuned(Wheel& w);

}  // namespace hil

#endif
