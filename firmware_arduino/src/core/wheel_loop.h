// One side's wheels: speed from the encoder, a wheel law of docs/wheel-loop.md, limits.
// Signs: positive duty, PWM and speed drive forward and make counts rise. Duty is a ratio, -1 to 1.
#ifndef HIL_CORE_WHEEL_LOOP_H
#define HIL_CORE_WHEEL_LOOP_H

#include <stdint.h>

#include "super_twisting.h"
#include "wheel_laws.h"

namespace hil {

<<<<<<< HEAD
enum class Law : uint8_t { ASG_ISM = 0,
                           PID = 1 };
enum class Form : uint8_t { INTEGRAL = 0,
                            DERIVATIVE = 1 };
// How the law of this tick starts: it goes on, or its integrals begin anew and the output jumps to what
// the law says (ANEW), stays where it is (RETUNED), or keeps its feedback part (STEPPED).
enum class Start : uint8_t { RUNNING,
                             ANEW,
                             RETUNED,
                             STEPPED };

=======
>>>>>>> main
// Everything a tick needs of the parameters, divided and rooted beforehand; shared by both sides.
struct WheelTuning {
  SuperTwistingGains st;
  float rad_per_count;
  float omega_blend;  // share of a new value the speed filter takes per tick
  float error_rate_blend;
  float inv_error_rate_tau_1_s;
  float ff_duty_s_rad, ff_dead_duty, ff_inv_dead_s_rad;
  float hold_setpoint_rad_s, hold_omega_rad_s;
  Law law;
<<<<<<< HEAD
  Form form;
  float bump_keep;  // share of the transfer offset left after one tick
  float sigma, sigma_tick, average_max, mu0_s, mu_start, eps0, eps_min;
  float mu_hold_s;    // value of t + mu0 at which mu stops falling
  float eps_until_s;  // value of t + mu0 from which eps(t) is at its floor
  float two_g, two_k0, gamma0, gamma1, gamma2, step_rad_s;
  float kp, ki, kd;
=======
#define WHEEL_LAW(ID, files, name, doc) wheel_##files::Tuning files;
#include "laws.def"
#undef WHEEL_LAW
  float bump_keep;         // share of the transfer offset left after one tick
>>>>>>> main
  int16_t pwm_max_counts, slew_counts;
};

WheelTuning wheel_tuning(const Params& params);

<<<<<<< HEAD
// Sliding variable and the terms it is made of, docs/wheel-loop.md.
struct Sliding {
  float t_mu0_s;   // t + mu0; t restarts at arming and when the set-point steps
  float mu;        // 1 / (t + mu0)
  float integral;  // E, integral of e (the integral form)
  float average;   // sigma * integral of sgn(xa)
  float eta;       // makes s(0) = 0
  float s;
  float eps;   // boundary layer in force
  float gain;  // k(t), duty (duty/s in the derivative form)
};

// What follows from the set-point alone; worked out when it changes, which is 30 times a second.
struct Demand {
  float setpoint_rad_s;
  float forward_duty;  // feed-forward
  // gamma0 + gamma1 |omega*|, the part of F of (2.9) that the set-point fixes. The pose of (2.9) has no
  // meaning for a wheel that turns on and on; its place is taken by the speed asked for.
  float bound;
  bool zero;  // counts as zero
};

struct Wheel {
  int32_t last_counts;
  SuperTwisting st;
  float omega_rad_s;  // low-passed estimate
  Demand demand;
  float step_base_rad_s;    // set-point at which t last restarted
  float error_rad_s;        // e = omega - omega*
  float error_lag_rad_s;    // low-passed e
  float error_rate_rad_s2;  // filtered derivative of e
  Sliding sliding;
  float pid_integral_rad;  // integral of e of the PID benchmark
  float rate_duty;         // integrated control of the derivative form
  float feedback_duty;     // law plus transfer offset, without feed-forward
  float duty;              // wanted, before the limits
  float bump_duty;         // transfer offset, decays
  int8_t saturation;       // +1: held below what is wanted, -1: above, 0: free
  bool holding;            // zero set-point and slow: bridge off
  Start start;             // of the next tick
  int16_t pwm;             // applied, -PWM_TOP to PWM_TOP
=======
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
>>>>>>> main
};

void wheel_init(Wheel& w, const WheelTuning& t, int32_t counts);
// Speed from the counts of this tick. Float operations, division and root as four: 20; 2,500 cycles on
// the ATmega2560.
void wheel_estimate(Wheel& w, const WheelTuning& t, int32_t counts);
// Wanted duty for the set-point. Float operations: ASG-ISM 38 (while eps(t) still falls 46), PID 18; on
// a new set-point 8 more. ASG-ISM takes 6,500 cycles.
void wheel_control(Wheel& w, const WheelTuning& t, float setpoint_rad_s);
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
