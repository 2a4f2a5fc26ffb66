// Averaged sub-gradient integral sliding mode of the wheel loop, docs/wheel-loop.md.
#ifndef HIL_CORE_WHEEL_ASG_ISM_H
#define HIL_CORE_WHEEL_ASG_ISM_H

#include "wheel_law.h"

namespace hil {
namespace wheel_asg_ism {

enum class Form : uint8_t { INTEGRAL = 0, DERIVATIVE = 1 };

struct Tuning {
  Form form;
  float sigma, sigma_tick, average_max, mu0_s, mu_start, eps0, eps_min;
  float mu_hold_s;    // value of t + mu0 at which mu stops falling
  float eps_until_s;  // value of t + mu0 from which eps(t) is at its floor
  float two_g, two_k0, gamma0, gamma1, gamma2, step_rad_s;
};

// Sliding variable and the terms it is made of.
struct State {
  float t_mu0_s;   // t + mu0; t restarts at arming and when the set-point steps
  float mu;        // 1 / (t + mu0)
  float integral;  // E, integral of e (the integral form)
  float average;   // sigma * integral of sgn(xa)
  float eta;       // makes s(0) = 0
  float s;
  float eps;              // boundary layer in force
  float gain;             // k(t), duty (duty/s in the derivative form)
  float rate_duty;        // integrated control of the derivative form
  float step_base_rad_s;  // set-point at which t last restarted
  // gamma0 + gamma1 |omega*|, the part of F of (2.9) that the set-point fixes. The pose of (2.9) has no
  // meaning for a wheel that turns on and on; its place is taken by the speed asked for.
  float bound;
};

Tuning tuning(const Params& params);
inline void forget(State& law) { law.rate_duty = law.s = 0.0f; }
bool stepped(const State& law, const Tuning& t, float setpoint_rad_s);
// Float operations: 28 (while eps(t) still falls 36); on a new set-point 3 more. 5,700 cycles.
float step(State& law, const Tuning& t, const Tracked& w);
inline float sliding(const State& law) { return law.s; }

}  // namespace wheel_asg_ism
}  // namespace hil

#endif
