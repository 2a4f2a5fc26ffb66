#include "quadrotor.hpp"

#include "signals.hpp"

namespace chapters {

using control::Vec;

Vec3 times(const std::array<Vec3, 3>& a, const Vec3& b) { return {dot(a[0], b), dot(a[1], b), dot(a[2], b)}; }

namespace {

// Solves a y = b for a symmetric positive 3 x 3 matrix by its adjugate.
Vec3 solve(const std::array<Vec3, 3>& a, const Vec3& b) {
  const auto cross = [](const Vec3& p, const Vec3& q) {
    return Vec3{p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
  };
  const Vec3 c0 = cross(a[1], a[2]), c1 = cross(a[2], a[0]), c2 = cross(a[0], a[1]);
  const double det = dot(a[0], c0);
  Vec3 y;
  for (int i = 0; i < 3; ++i) y[i] = (c0[i] * b[0] + c1[i] * b[1] + c2[i] * b[2]) / det;
  return y;
}

}  // namespace

Quadrotor::Matrices Quadrotor::matrices(const Vec3& angle, const Vec3& rate) const {
  return matrices(std::sin(angle[1]), std::cos(angle[1]), std::sin(angle[2]), std::cos(angle[2]), rate);
}

Quadrotor::Matrices Quadrotor::matrices(double s, double c, double S, double K, const Vec3& rate) const {
  const double a = ixx_kg_m2, b = iyy_kg_m2, d = izz_kg_m2;
  const double psi = rate[0], theta = rate[1], phi = rate[2];
  Matrices m;
  m.inertia = {Vec3{a * s * s + (b * S * S + d * K * K) * c * c, (b - d) * c * S * K, -a * s},
               Vec3{(b - d) * c * S * K, b * K * K + d * S * S, 0.0}, Vec3{-a * s, 0.0, a}};
  // dM_ij/dq_k; nothing depends on psi
  double by[3][3][3] = {};
  by[1][0][0] = 2.0 * s * c * (a - b * S * S - d * K * K);
  by[1][0][1] = by[1][1][0] = -(b - d) * s * S * K;
  by[1][0][2] = by[1][2][0] = -a * c;
  by[2][0][0] = 2.0 * (b - d) * c * c * S * K;
  by[2][0][1] = by[2][1][0] = (b - d) * c * (K * K - S * S);
  by[2][1][1] = -2.0 * (b - d) * S * K;
  const double q_dot[3] = {psi, theta, phi};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double sum = 0.0;
      for (int k = 0; k < 3; ++k) sum += 0.5 * (by[k][i][j] + by[j][i][k] - by[i][j][k]) * q_dot[k];
      m.coriolis[i][j] = sum;
    }
  }
  return m;
}

Quadrotor::State Quadrotor::rates(const State& x, const Input& wanted,
                                  const std::array<double, 6>& xi) const {
  const double cps = std::cos(x[6]), sps = std::sin(x[6]), cth = std::cos(x[7]), sth = std::sin(x[7]);
  const double cph = std::cos(x[8]), sph = std::sin(x[8]);
  const Vec3 rate{x[9], x[10], x[11]};
  const bool ideal = motor_lag_s <= 0.0;
  const double lift = (ideal ? wanted.thrust : x[12]) / mass_kg, drag = drag_n_s2_m2 / mass_kg;
  const Matrices m = matrices(sth, cth, sph, cph, rate);
  const Vec3 turn = times(m.coriolis, rate);
  Vec3 torque;
  for (int i = 0; i < 3; ++i) torque[i] = (ideal ? wanted.torque[i] : x[13 + i]) - turn[i];
  const Vec3 spin = solve(m.inertia, torque);
  State out{};
  for (int i = 0; i < 3; ++i) {
    out[i] = x[3 + i];
    out[6 + i] = rate[i];
    out[9 + i] = spin[i] + xi[3 + i];
    out[13 + i] = ideal ? 0.0 : (wanted.torque[i] - x[13 + i]) / motor_lag_s;
  }
  out[3] = (cps * sth * cph + sps * sph) * lift - drag * x[3] * std::abs(x[3]) + xi[0];
  out[4] = (sps * sth * cph - cps * sph) * lift - drag * x[4] * std::abs(x[4]) + xi[1];
  out[5] = cth * cph * lift - gravity_m_s2 + xi[2];
  out[12] = ideal ? 0.0 : (wanted.thrust - x[12]) / motor_lag_s;
  return out;
}

double Quadrotor::energy(const State& x) const {
  const Vec3 v{x[3], x[4], x[5]}, rate{x[9], x[10], x[11]};
  const Matrices m = matrices({x[6], x[7], x[8]}, rate);
  return 0.5 * mass_kg * dot(v, v) + mass_kg * gravity_m_s2 * x[2] + 0.5 * dot(rate, times(m.inertia, rate));
}

std::array<Vec3, 3> Quadrotor::reference(double t) const {
  const double w = rate_rad_s, c = std::cos(w * t), s = std::sin(w * t), r = radius_m;
  std::array<Vec3, 3> out{Vec3{r * c, r * s, 0.0}, Vec3{-r * w * s, r * w * c, 0.0},
                          Vec3{-r * w * w * c, -r * w * w * s, 0.0}};
  const double at[5] = {55.0, 43.0, 27.5, 17.5, 3.0};
  for (int i = 0; i < 5; ++i) {
    const bool up = i == 0 || (climb_alternates > 0.5 && i % 2 == 0);
    const double f = 1.0 / (1.0 + std::exp(-2.0 * (t - at[i]))), size = up ? climb_m : -climb_m;
    out[0][2] += size * f;
    out[1][2] += size * 2.0 * f * (1.0 - f);
    out[2][2] += size * 4.0 * f * (1.0 - f) * (1.0 - 2.0 * f);
  }
  return out;
}

namespace {

// The inversion of thrust and tilt for a wanted acceleration with psi* = 0.
struct Tilt {
  double thrust;
  Vec3 command;
};

Tilt tilt(const Quadrotor& p, const Vec3& a, double theta, double phi) {
  const double g = p.gravity_m_s2, lift = std::max(a[2] + g, 0.2 * g);
  const double thrust =
      std::max(p.mass_kg * (a[2] + g) / (std::cos(theta) * std::cos(phi)), 0.05 * p.mass_kg * g);
  const double pitch = clip(std::atan2(a[0], lift), p.tilt_max_rad);
  return {thrust, {0.0, pitch, clip(std::atan2(-a[1] * std::cos(pitch), lift), p.tilt_max_rad)}};
}

}  // namespace

Outcome fly(const Quadrotor& plant, control::Law& position, control::Law& attitude,
            const std::vector<double>& draws) {
  const double h = plant.step_s;
  const int ticks = static_cast<int>(plant.duration_s / h),
            every = std::max(1, static_cast<int>(std::lround(plant.sample_s / h)));
  const int hold = std::max(1, static_cast<int>(std::lround(plant.hold_s / h)));
  Tally tally({plant.duration_s, h, plant.settle_s, plant.early_s, plant.give_up_m, every});
  std::array<control::SmoothCommand, 3> smooth{control::SmoothCommand(plant.attitude_filter_rad_s),
                                               control::SmoothCommand(plant.attitude_filter_rad_s),
                                               control::SmoothCommand(plant.attitude_filter_rad_s)};
  Quadrotor::State x{};
  x[0] = plant.start_x_m;
  x[1] = plant.start_y_m;
  x[2] = plant.start_z_m;
  x[3] = plant.start_vx_m_s;
  x[4] = plant.start_vy_m_s;
  x[12] = plant.mass_kg * plant.gravity_m_s2;
  std::array<double, 6> xi{};
  const bool fed = plant.attitude_feed_forward > 0.5;
  for (int k = 0; k < ticks; ++k) {
    const double t = k * h;
    if (k % hold == 0) {
      for (std::size_t i = 0; i < 6; ++i) {
        const std::size_t at = static_cast<std::size_t>(k / hold) * 6 + i;
        xi[i] = at < draws.size() ? plant.disturbance * draws[at] : 0.0;
      }
    }
    const auto ref = plant.reference(t);
    Vec p{}, q{};
    for (int i = 0; i < 3; ++i) {
      p[i] = x[i] - ref[0][i];
      q[i] = x[3 + i] - ref[1][i];
    }
    if (k == 0) position.reset(p, q);
    const Vec pull = position.output(t, p, q, h);
    Vec3 a;
    for (int i = 0; i < 3; ++i) a[i] = clip(ref[2][i] + pull[i], plant.accel_max_m_s2);
    const Tilt wanted = tilt(plant, a, x[7], x[8]);
    Vec pa{}, qa{};
    Vec3 forward{};
    for (int i = 0; i < 3; ++i) {
      if (k == 0) smooth[i].reset(wanted.command[i]);
      pa[i] = x[6 + i] - (fed ? smooth[i].value() : wanted.command[i]);
      qa[i] = x[9 + i] - (fed ? smooth[i].rate() : 0.0);
      forward[i] = fed ? smooth[i].acceleration(wanted.command[i]) : 0.0;
      if (fed) smooth[i].step(wanted.command[i], h);
    }
    if (k == 0) attitude.reset(pa, qa);
    const Vec twist = attitude.output(t, pa, qa, h);
    position.advance(h);
    attitude.advance(h);
    const Vec3 rate{x[9], x[10], x[11]};
    const auto m = plant.matrices({x[6], x[7], x[8]}, rate);
    const Vec3 push = times(m.inertia, {forward[0] + twist[0], forward[1] + twist[1], forward[2] + twist[2]});
    const Vec3 turn = times(m.coriolis, rate);
    Quadrotor::Input input{wanted.thrust, {}};
    for (int i = 0; i < 3; ++i) input.torque[i] = push[i] + turn[i];
    const double u2 = input.thrust * input.thrust + dot(input.torque, input.torque);
    const Vec3 e{p[0], p[1], p[2]};
    if (!tally.add(t, e, u2)) break;
    Outcome& out = tally.out;
    out.peak = std::max(out.peak, input.thrust);
    out.s_max[0] = std::max(out.s_max[0], position.s_norm());
    out.s_max[1] = std::max(out.s_max[1], attitude.s_norm());
    if (t > plant.settle_s) out.tilt_late = std::max({out.tilt_late, std::abs(x[7]), std::abs(x[8])});
    if (k % every == 0) {
      out.samples.insert(out.samples.end(), {t, x[0], x[1], x[2], ref[0][0], ref[0][1], ref[0][2],
                                             std::sqrt(dot(e, e)), out.ise, u2, out.effort});
    }
    x = rk4([&](double, const Quadrotor::State& y) { return plant.rates(y, input, xi); }, t, x, h);
    if (std::abs(x[7]) > 1.55 || std::abs(x[8]) > 1.55) {  // 0.02 rad short of 90 degrees
      tally.out.end_s = t + h;
      tally.stop(End::tumbled);
      break;
    }
  }
  tally.finish();
  return tally.out;
}

}  // namespace chapters
