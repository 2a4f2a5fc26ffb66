#include "fast.h"

#include "wheel_asg_ism.h"

#include <math.h>

#include "constants.h"
#include "flt.h"

namespace hil {
namespace wheel_asg_ism {

namespace {

// t = 0 with s(0) = 0. (xb, xa) is (e, E) or, in the derivative form, (de/dt, e); E restarts at 0.
void restart_sliding(State& sl, const Tuning& t, float xb, float xa) {
  sl.t_mu0_s = t.mu0_s;
  sl.mu = t.mu_start;
  sl.integral = 0.0f;
  sl.average = 0.0f;
  sl.eta = -xa - t.mu0_s * xb;
}

bool mu_stands(const State& sl, const Tuning& t) { return sl.t_mu0_s >= t.mu_hold_s; }

// mu = 1 / (t + mu0), until it stands; the layer's time goes on until its floor is reached.
void pass_time(State& sl, const Tuning& t) {
  if (mu_stands(sl, t)) {
    if (sl.t_mu0_s < t.eps_until_s) sl.t_mu0_s += TICK_S;
    return;
  }
  sl.t_mu0_s += TICK_S;
  sl.mu = 1.0f / sl.t_mu0_s;
}

// eps(t) with beta = 1/2, whose root is the one power soft float can afford; returns |d eps / dt|.
float boundary_layer(State& sl, const Tuning& t) {
  sl.eps = t.eps_min;
  if (sl.t_mu0_s >= t.eps_until_s) return 0.0f;
  const float inv_t = mu_stands(sl, t) ? 1.0f / sl.t_mu0_s : sl.mu;
  sl.eps = t.eps0 * inv_t * sqrtf(inv_t);
  return 1.5f * sl.eps * inv_t;
}

// What mu and Psi do to s by themselves. While mu falls: mu xb - mu^2 (xa + eta) + mu (sigma sgn xa - Psi),
// with s put in for the sum it contains. Once mu stands d mu/dt = 0, and only mu (xb + sigma sgn xa) is left.
float kappa_of(const State& sl, const Tuning& t, float xb, float xa) {
  const float pushed = xb + with_sign(t.sigma, xa);
  return sl.mu * (mu_stands(sl, t) ? pushed : pushed + xb - sl.s);
}

// k(t) s / (|s| + eps(t)): (4.12)-(4.16) with the corrections of docs/wheel-loop.md.
float sliding_control(State& sl, const Tuning& t, float xb, float xa, float bound) {
  const float mu = sl.mu;
  sl.s = xb + mu * (xa + sl.eta + sl.average);
  const float kappa = kappa_of(sl, t, xb, xa);
  const float eps_rate = boundary_layer(sl, t);
  sl.gain = t.two_g * (bound + fabsf(kappa) + eps_rate) + t.two_k0;
  return sl.gain * sl.s / (fabsf(sl.s) + sl.eps);
}

}  // namespace

Tuning tuning(const Params& p) {
  Tuning t;
  t.form = p.ism_form >= 1.0f ? Form::DERIVATIVE : Form::INTEGRAL;
  t.sigma = p.ism_sigma;
  t.sigma_tick = p.ism_sigma * TICK_S;
  t.mu0_s = p.ism_mu0_s;
  t.eps0 = p.ism_eps0;
  t.mu_start = 1.0f / p.ism_mu0_s;
  t.mu_hold_s = fmaxf(p.ism_hold_s, p.ism_mu0_s);
  t.average_max = p.ism_sigma * t.mu_hold_s;
  t.eps_min = p.ism_eps_min;
  t.eps_until_s = powf(p.ism_eps0 / t.eps_min, 2.0f / 3.0f);
  t.two_g = 2.0f * p.ism_g_duty_s2_rad;
  t.two_k0 = 2.0f * p.ism_k0_duty;
  t.gamma0 = p.ism_gamma0_rad_s2;
  t.gamma1 = p.ism_gamma1_1_s;
  t.gamma2 = p.ism_gamma2_1_s;
  t.step_rad_s = p.ism_step_rad_s;
  return t;
}

bool stepped(const State& sl, const Tuning& t, float setpoint_rad_s) {
  return fabsf(setpoint_rad_s - sl.step_base_rad_s) > t.step_rad_s;
}

float step(State& sl, const Tuning& t, const Tracked& w) {
  const bool derivative = t.form == Form::DERIVATIVE;
  const float xb = derivative ? w.error_rate_rad_s2 : w.error_rad_s;
  if (w.start != Start::RUNNING) {
    restart_sliding(sl, t, xb, derivative ? w.error_rad_s : 0.0f);
    sl.step_base_rad_s = w.demand.setpoint_rad_s;
  }
  if (w.fresh) sl.bound = t.gamma0 + t.gamma1 * fabsf(w.demand.setpoint_rad_s);
  const float xa = derivative ? w.error_rad_s : sl.integral;
  const float push = sliding_control(sl, t, xb, xa, sl.bound + t.gamma2 * fabsf(w.omega_rad_s));
  pass_time(sl, t);
  if (may_integrate(w, w.error_rad_s)) sl.integral += TICK_S * w.error_rad_s;
  // |Psi| <= sigma: by itself while mu falls, by the limit once it stands.
  if (may_integrate(w, xa)) {
    sl.average = clamp(sl.average + with_sign(t.sigma_tick, xa), t.average_max);
  }
  if (!derivative) return -push;
  // Relative degree two: the law sets the rate of the duty, and the duty itself stays continuous.
  if (may_integrate(w, push)) sl.rate_duty -= TICK_S * push;
  return sl.rate_duty;
}

}  // namespace wheel_asg_ism
}  // namespace hil
