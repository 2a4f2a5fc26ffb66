// Underwater vehicle of chapter 6 in six degrees of freedom: (2.15)-(2.19) with table 6.2. World
// axes z down; quaternion attitude; body u, v, w, p, q, r. C21 has -m z_G r (printed +): C is skew.
#pragma once

#include "law.hpp"
#include "outcome.hpp"

namespace chapters {

// clang-format off
#define VEHICLE6_PARAMETERS(X)                                                                      \
  X(mass_kg) X(weight_n) X(metacentre_m)                                                            \
  X(added_u_kg) X(added_v_kg) X(added_w_kg) X(added_p_kg_m2) X(added_q_kg_m2) X(added_r_kg_m2)      \
  X(ixx_kg_m2) X(iyy_kg_m2) X(izz_kg_m2)                                                            \
  X(x_u) X(y_v) X(z_w) X(k_p) X(m_q) X(n_r) X(y_r) X(z_q) X(m_w) X(n_v)                             \
  X(x_uu) X(y_vv) X(z_ww) X(k_pp) X(m_qq) X(n_rr) X(y_rr) X(z_qq) X(m_ww) X(n_vv)                   \
  X(fin_force_n) X(fin_moment_n_m) X(fin_moments)                                                   \
  X(turn_rad_s) X(turn_radius_m) X(dive_m) X(reference_feed_forward)                                \
  X(disturbance_m_s2) X(disturbance_rate_ratio) X(force_max_n) X(bare_mass) X(noise_m)              \
  X(estimated_rate) X(control_kept) X(differentiator_bound_m_s2) X(differentiator_l1)               \
  X(differentiator_l0) X(differentiator_implicit)                                                   \
  X(start_x_m) X(start_y_m) X(start_z_m) X(start_u_m_s)                                             \
  X(duration_s) X(step_s) X(settle_s) X(early_s) X(give_up_m) X(sample_s)
// clang-format on

struct Vehicle6 {
#define X(name) double name = 0.0;
  VEHICLE6_PARAMETERS(X)
#undef X

  using State = std::array<double, 13>;  // x, y, z, quaternion (scalar first), u, v, w, p, q, r
  using Six = std::array<double, 6>;

  Six inertia() const;
  // C(v) v with the whole C, and C itself for who wants to see that it is skew
  std::array<Six, 6> coriolis(const Six& v) const;
  Six damping(const Six& v) const;
  Waves<3> waves(double dt, double t = 0.0) const;
  Vec3 gust(const Waves<3>& waves) const;  // m/s^2, world
  State rates(const Vec3& gust, const State& x, const Vec3& force) const;
  double energy(const State& x) const;
  std::array<Vec3, 3> reference(double t) const;
};

// Rotation matrix of the quaternion in x, body to world.
std::array<Vec3, 3> rotation(const Vehicle6::State& x);

Outcome swim(const Vehicle6& plant, control::Law& position, const std::vector<double>& noise);

}  // namespace chapters
