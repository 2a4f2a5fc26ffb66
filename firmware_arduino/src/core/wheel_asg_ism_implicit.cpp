#include "fast.h"

#include "wheel_asg_ism_implicit.h"

#include <math.h>

#include "constants.h"
#include "flt.h"

namespace hil {
namespace wheel_asg_ism_implicit {

Tuning tuning(const Params& p) {
  Tuning t;
  t.mu = p.imp_mu_1_s;
  t.sigma = p.imp_sigma;
  t.sigma_tick = p.imp_sigma * TICK_S;
  t.start_s = 1.0f / p.imp_mu_1_s;
  t.average_max = p.imp_sigma * t.start_s;
  t.g = p.ism_g_duty_s2_rad;
  t.g_over_step = p.ism_g_duty_s2_rad / fmaxf(p.imp_step_s, TICK_S);
  t.bound_duty = p.imp_k_duty;
  t.step_rad_s = p.ism_step_rad_s;
  return t;
}

bool stepped(const State& sl, const Tuning& t, float setpoint_rad_s) {
  return fabsf(setpoint_rad_s - sl.step_base_rad_s) > t.step_rad_s;
}

float step(State& sl, const Tuning& t, const Tracked& w) {
  const float e = w.error_rad_s;
  if (w.start != Start::RUNNING) {
    sl.integral = sl.average = 0.0f;
    sl.eta = -t.start_s * e;
    sl.step_base_rad_s = w.demand.setpoint_rad_s;
  }
  sl.s = e + t.mu * (sl.integral + sl.eta + sl.average);
  const float kappa = t.mu * (e + with_sign(t.sigma, sl.integral));
  // u in -k Sgn(s + u step/g) has one solution: minus the projection of s g/step on [-k, k].
  const float term = clamp(t.g_over_step * sl.s, t.bound_duty);
  if (may_integrate(w, e)) sl.integral += TICK_S * e;
  if (may_integrate(w, sl.integral)) {
    sl.average = clamp(sl.average + with_sign(t.sigma_tick, sl.integral), t.average_max);
  }
  return -(t.g * kappa + term);
}

}  // namespace wheel_asg_ism_implicit
}  // namespace hil
