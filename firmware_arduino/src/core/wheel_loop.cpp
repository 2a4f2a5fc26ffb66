#include "fast.h"

#include "wheel_loop.h"

#include <math.h>

#include "constants.h"
#include "flt.h"

namespace hil {

namespace {

constexpr float TWO_PI_RAD = 6.2831853f;

float clamp(float x, float limit) {
  if (x > limit) return limit;
  return x < -limit ? -limit : x;
}

// Share a first-order low-pass takes of a new value per tick (backward Euler).
float blend(float tau_s) { return TICK_S / (tau_s + TICK_S); }

// Both laws fall as their integrals grow, so growth in the direction of `push` would drive the output
// further beyond the limit it is held at.
bool may_integrate(const Wheel& w, float push) {
  return w.saturation == 0 || (w.saturation > 0) == (push > 0.0f);
}

Demand demand_of(const WheelTuning& t, float setpoint_rad_s) {
  const float coulomb = clamp(setpoint_rad_s * t.ff_inv_dead_s_rad, 1.0f);
  const float size = fabsf(setpoint_rad_s);
  return {setpoint_rad_s, t.ff_duty_s_rad * setpoint_rad_s + t.ff_dead_duty * coulomb,
          t.gamma0 + t.gamma1 * size, size <= t.hold_setpoint_rad_s};
}

// e and its filtered derivative; both forms of the law, PID and telemetry use them.
void track_error(Wheel& w, const WheelTuning& t) {
  w.error_rad_s = w.omega_rad_s - w.demand.setpoint_rad_s;
  if (w.start == Start::ANEW) w.error_lag_rad_s = w.error_rad_s;
  const float lead = w.error_rad_s - w.error_lag_rad_s;
  w.error_rate_rad_s2 = lead * t.inv_error_rate_tau_1_s;
  w.error_lag_rad_s += t.error_rate_blend * lead;
}

// t = 0 with s(0) = 0. (xb, xa) is (e, E) or, in the derivative form, (de/dt, e); E restarts at 0.
void restart_sliding(Sliding& sl, const WheelTuning& t, float xb, float xa) {
  sl.t_mu0_s = t.mu0_s;
  sl.mu = t.mu_start;
  sl.integral = 0.0f;
  sl.average = 0.0f;
  sl.eta = -xa - t.mu0_s * xb;
}

bool mu_stands(const Sliding& sl, const WheelTuning& t) { return sl.t_mu0_s >= t.mu_hold_s; }

// mu = 1 / (t + mu0), until it stands; the layer's time goes on until its floor is reached.
void pass_time(Sliding& sl, const WheelTuning& t) {
  if (mu_stands(sl, t)) {
    if (sl.t_mu0_s < t.eps_until_s) sl.t_mu0_s += TICK_S;
    return;
  }
  sl.t_mu0_s += TICK_S;
  sl.mu = 1.0f / sl.t_mu0_s;
}

// eps(t) with beta = 1/2, whose root is the one power soft float can afford; returns |d eps / dt|.
float boundary_layer(Sliding& sl, const WheelTuning& t) {
  sl.eps = t.eps_min;
  if (sl.t_mu0_s >= t.eps_until_s) return 0.0f;
  const float inv_t = mu_stands(sl, t) ? 1.0f / sl.t_mu0_s : sl.mu;
  sl.eps = t.eps0 * inv_t * sqrtf(inv_t);
  return 1.5f * sl.eps * inv_t;
}

// What mu and Psi do to s by themselves. While mu falls: mu xb - mu^2 (xa + eta) + mu (sigma sgn xa - Psi),
// with s put in for the sum it contains. Once mu stands d mu/dt = 0, and only mu (xb + sigma sgn xa) is left.
float kappa_of(const Sliding& sl, const WheelTuning& t, float xb, float xa) {
  const float pushed = xb + with_sign(t.sigma, xa);
  return sl.mu * (mu_stands(sl, t) ? pushed : pushed + xb - sl.s);
}

// k(t) s / (|s| + eps(t)): (4.12)-(4.16) with the corrections of docs/wheel-loop.md.
float sliding_control(Sliding& sl, const WheelTuning& t, float xb, float xa, float bound) {
  const float mu = sl.mu;
  sl.s = xb + mu * (xa + sl.eta + sl.average);
  const float kappa = kappa_of(sl, t, xb, xa);
  const float eps_rate = boundary_layer(sl, t);
  sl.gain = t.two_g * (bound + fabsf(kappa) + eps_rate) + t.two_k0;
  return sl.gain * sl.s / (fabsf(sl.s) + sl.eps);
}

float asg_ism(Wheel& w, const WheelTuning& t) {
  Sliding& sl = w.sliding;
  const bool derivative = t.form == Form::DERIVATIVE;
  const float xb = derivative ? w.error_rate_rad_s2 : w.error_rad_s;
  if (w.start != Start::RUNNING) {
    restart_sliding(sl, t, xb, derivative ? w.error_rad_s : 0.0f);
    w.step_base_rad_s = w.demand.setpoint_rad_s;
  }
  const float xa = derivative ? w.error_rad_s : sl.integral;
  const float push =
      sliding_control(sl, t, xb, xa, w.demand.bound + t.gamma2 * fabsf(w.omega_rad_s));
  pass_time(sl, t);
  if (may_integrate(w, w.error_rad_s)) sl.integral += TICK_S * w.error_rad_s;
  // |Psi| <= sigma: by itself while mu falls, by the limit once it stands.
  if (may_integrate(w, xa)) {
    sl.average = clamp(sl.average + with_sign(t.sigma_tick, xa), t.average_max);
  }
  if (!derivative) return -push;
  // Relative degree two: the law sets the rate of the duty, and the duty itself stays continuous.
  if (may_integrate(w, push)) w.rate_duty -= TICK_S * push;
  return w.rate_duty;
}

float pid(Wheel& w, const WheelTuning& t) {
  const float out =
      -(t.kp * w.error_rad_s + t.ki * w.pid_integral_rad + t.kd * w.error_rate_rad_s2);
  if (may_integrate(w, w.error_rad_s)) w.pid_integral_rad += TICK_S * w.error_rad_s;
  return out;
}

// A new set-point; far enough from where t last started it is a step.
void take_setpoint(Wheel& w, const WheelTuning& t, float setpoint_rad_s) {
  w.demand = demand_of(t, setpoint_rad_s);
  const bool far = fabsf(setpoint_rad_s - w.step_base_rad_s) > t.step_rad_s;
  if (far && w.start == Start::RUNNING && t.law == Law::ASG_ISM) w.start = Start::STEPPED;
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
  t.st = super_twisting_gains(static_cast<Scheme>(static_cast<uint8_t>(p.st_scheme)), p.st_l_rad_s2,
                              p.st_l0, p.st_l1, p.st_cell_counts * t.rad_per_count, TICK_S);
  if (p.st_variable >= 1.0f) {
    super_twisting_vary(t.st, p.st_l_min_rad_s2, p.st_rho_1_s, p.st_alpha);
  }
  t.omega_blend = blend(p.omega_tau_s);
  t.error_rate_blend = blend(p.error_rate_tau_s);
  t.inv_error_rate_tau_1_s = 1.0f / (p.error_rate_tau_s + TICK_S);
  t.ff_duty_s_rad = p.ff_duty_s_rad;
  t.ff_dead_duty = p.ff_dead_duty;
  t.ff_inv_dead_s_rad = 1.0f / p.ff_dead_rad_s;
  t.hold_setpoint_rad_s = p.hold_setpoint_rad_s;
  t.hold_omega_rad_s = p.hold_omega_rad_s;
  t.law = p.law >= 1.0f ? Law::PID : Law::ASG_ISM;
  t.form = p.ism_form >= 1.0f ? Form::DERIVATIVE : Form::INTEGRAL;
  t.bump_keep = 1.0f - blend(p.bump_tau_s);
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
  t.kp = p.pid_kp_duty_s_rad;
  t.ki = p.pid_ki_duty_rad;
  t.kd = p.pid_kd_duty_s2_rad;
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
  const int32_t moved = static_cast<int32_t>(static_cast<uint32_t>(counts) -
                                             static_cast<uint32_t>(w.last_counts));
  w.last_counts = counts;
  const float raw = super_twisting_step(w.st, t.st, static_cast<float>(moved) * t.rad_per_count);
  w.omega_rad_s += t.omega_blend * (raw - w.omega_rad_s);
}

void wheel_control(Wheel& w, const WheelTuning& t, float setpoint_rad_s) {
  if (setpoint_rad_s != w.demand.setpoint_rad_s || w.start != Start::RUNNING) {
    take_setpoint(w, t, setpoint_rad_s);
  }
  w.holding = w.demand.zero && fabsf(w.omega_rad_s) <= t.hold_omega_rad_s;
  if (w.holding) {
    wheel_off(w);
    return;
  }
  if (w.start == Start::RETUNED) w.pid_integral_rad = w.rate_duty = w.sliding.s = 0.0f;
  track_error(w, t);
  const float law = t.law == Law::PID ? pid(w, t) : asg_ism(w, t);
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

void wheel_off(Wheel& w) {
  w.start = Start::ANEW;
  w.duty = 0.0f;
  w.pwm = 0;
  w.feedback_duty = w.bump_duty = 0.0f;
  w.pid_integral_rad = w.rate_duty = 0.0f;
  w.error_rate_rad_s2 = 0.0f;
  w.saturation = 0;
  w.sliding.s = 0.0f;
}

void wheel_retuned(Wheel& w) {
  if (w.start == Start::RUNNING) w.start = Start::RETUNED;
}

}  // namespace hil
