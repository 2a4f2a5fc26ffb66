// Underwater vehicle of chapters 5 and 7 in five degrees of freedom, (2.20)-(2.22), and the cascade
// position -> (v, w) -> (u, q, r) -> torque. World frame as the thesis; body u, v, w, q, r.
#pragma once

#include "law.hpp"
#include "outcome.hpp"

namespace chapters {

// clang-format off
#define VEHICLE5_PARAMETERS(X)                                                                      \
  X(m11_kg) X(m22_kg) X(m33_kg) X(m55_kg_m2) X(m66_kg_m2) X(d11_kg_s) X(d22_kg_s) X(d33_kg_s)       \
  X(d55_kg_m2_s) X(d66_kg_m2_s) X(mass_kg) X(gravity_m_s2) X(metacentre_m)                          \
  X(motor) X(motor_inductance_h) X(motor_resistance_ohm) X(motor_gain_n_a) X(motor_emf_v_s_m)       \
  X(motor_loop_rad_s)                                                                               \
  X(start_x_m) X(start_y_m) X(start_z_m) X(start_u_m_s)                                             \
  X(velocity_disturbance_m_s) X(accel_disturbance_m_s2) X(disturbance_rate_ratio)                   \
  X(effective_gain) X(gain_floor_m_s) X(turn_rate_max_rad_s) X(pitch_max_rad)                       \
  X(correction_max_m_s) X(surge_min_m_s) X(surge_max_m_s) X(side_max_m_s) X(command_lag_s)          \
  X(feed_differentiator) X(differentiator_bound_m_s2)                                               \
  X(duration_s) X(step_s) X(settle_s) X(early_s) X(give_up_m) X(sample_s)
// clang-format on

struct Vehicle5 {
#define X(name) double name = 0.0;
  VEHICLE5_PARAMETERS(X)
#undef X

  // X, Y, Z, theta, psi, u, v, w, q, r, three motor currents
  using State = std::array<double, 13>;

  double righting_n_m() const { return mass_kg * gravity_m_s2 * metacentre_m; }
  struct Gust {
    Vec3 moved, pushed;            // m/s on the world position, m/s^2 on u, v, w
    std::array<double, 2> turned;  // rad/s^2 on q, r
  };
  Waves<8> waves(double dt, double t = 0.0) const;
  Gust gust(const Waves<8>& waves) const;
  Gust gust(double t) const { return gust(waves(0.0, t)); }
  State rates(const Gust& gust, const State& x, const Vec3& torque, const Vec3& volt) const;
  double energy(const State& x) const;
  std::array<Vec3, 3> reference(double t) const;
};

Outcome dive(const Vehicle5& plant, control::Law& position, control::Law& sideways, control::Law& drive);

}  // namespace chapters
