// Quadrotor of chapter 4, (2.24)-(2.29). World frame, z up; attitude (psi, theta, phi): yaw, pitch,
// roll. The matrix C is derived from the inertia matrix by Christoffel symbols: entry (2, 3) differs
// from the printed one in the sign of its bracket with Izz, without which dM/dt - 2C is not skew.
#pragma once

#include "law.hpp"
#include "outcome.hpp"

namespace chapters {

// clang-format off
#define QUADROTOR_PARAMETERS(X)                                                                     \
  X(mass_kg) X(gravity_m_s2) X(ixx_kg_m2) X(iyy_kg_m2) X(izz_kg_m2) X(drag_n_s2_m2) X(motor_lag_s)  \
  X(tilt_max_rad) X(accel_max_m_s2) X(attitude_filter_rad_s) X(attitude_feed_forward)               \
  X(radius_m) X(rate_rad_s) X(climb_m) X(climb_alternates)                                          \
  X(start_x_m) X(start_y_m) X(start_z_m) X(start_vx_m_s) X(start_vy_m_s)                            \
  X(disturbance) X(hold_s) X(duration_s) X(step_s) X(settle_s) X(early_s) X(give_up_m)              \
  X(sample_s)
// clang-format on

struct Quadrotor {
#define X(name) double name = 0.0;
  QUADROTOR_PARAMETERS(X)
#undef X

  // x, y, z, their rates, psi, theta, phi, their rates, thrust N, torques N m
  using State = std::array<double, 16>;
  struct Input {
    double thrust = 0.0;
    Vec3 torque{};
  };
  struct Matrices {
    std::array<Vec3, 3> inertia{}, coriolis{};
  };

  Matrices matrices(const Vec3& angle, const Vec3& rate) const;
  // the same for sine and cosine of pitch (s, c) and roll (S, K)
  Matrices matrices(double s, double c, double S, double K, const Vec3& rate) const;
  State rates(const State& x, const Input& wanted, const std::array<double, 6>& xi) const;
  double energy(const State& x) const;
  // position, velocity and acceleration of the reference
  std::array<Vec3, 3> reference(double t) const;
};

Vec3 times(const std::array<Vec3, 3>& a, const Vec3& b);

Outcome fly(const Quadrotor& plant, control::Law& position, control::Law& attitude,
            const std::vector<double>& draws);

}  // namespace chapters
