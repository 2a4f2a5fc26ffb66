#include "vehicle6.hpp"

#include "signals.hpp"

namespace chapters {

using control::Vec;

std::array<Vec3, 3> rotation(const Vehicle6::State& x) {
  const double a = x[3], b = x[4], c = x[5], d = x[6];
  return {Vec3{1 - 2 * (c * c + d * d), 2 * (b * c - a * d), 2 * (b * d + a * c)},
          Vec3{2 * (b * c + a * d), 1 - 2 * (b * b + d * d), 2 * (c * d - a * b)},
          Vec3{2 * (b * d - a * c), 2 * (c * d + a * b), 1 - 2 * (b * b + c * c)}};
}

namespace {

Vec3 to_world(const std::array<Vec3, 3>& R, const Vec3& b) {
  return {dot(R[0], b), dot(R[1], b), dot(R[2], b)};
}

Vec3 to_body(const std::array<Vec3, 3>& R, const Vec3& w) {
  Vec3 out;
  for (int i = 0; i < 3; ++i) out[i] = R[0][i] * w[0] + R[1][i] * w[1] + R[2][i] * w[2];
  return out;
}

}  // namespace

Vehicle6::Six Vehicle6::inertia() const {
  return {mass_kg + added_u_kg,      mass_kg + added_v_kg,      mass_kg + added_w_kg,
          ixx_kg_m2 + added_p_kg_m2, iyy_kg_m2 + added_q_kg_m2, izz_kg_m2 + added_r_kg_m2};
}

std::array<Vehicle6::Six, 6> Vehicle6::coriolis(const Six& s) const {
  const Six m = inertia();
  const double mz = mass_kg * metacentre_m, p = s[3], q = s[4], r = s[5];
  const double mu = m[0] * s[0], mv = m[1] * s[1], mw = m[2] * s[2];
  const double a = m[3] * p, b = m[4] * q, c = m[5] * r;
  return {Six{0, 0, 0, mz * r, mw, -mv},
          Six{0, 0, 0, -mw, mz * r, mu},
          Six{0, 0, 0, -mz * p + mv, -mz * q - mu, 0},
          Six{-mz * r, mw, mz * p - mv, 0, c, -b},
          Six{-mw, -mz * r, mz * q + mu, -c, 0, a},
          Six{mv, -mu, 0, b, -a, 0}};
}

Vehicle6::Six Vehicle6::damping(const Six& s) const {
  Six n;
  for (int i = 0; i < 6; ++i) n[i] = std::abs(s[i]);
  return {(x_u + x_uu * n[0]) * s[0],
          (y_v + y_vv * n[1]) * s[1] + (y_r + y_rr * n[5]) * s[5],
          (z_w + z_ww * n[2]) * s[2] + (z_q + z_qq * n[4]) * s[4],
          (k_p + k_pp * n[3]) * s[3],
          (m_w + m_ww * n[2]) * s[2] + (m_q + m_qq * n[4]) * s[4],
          (n_v + n_vv * n[1]) * s[1] + (n_r + n_rr * n[5]) * s[5]};
}

Waves<3> Vehicle6::waves(double dt, double t) const {
  std::array<double, 3> rates{0.6, 0.9, 1.3};
  for (double& rate : rates) rate *= disturbance_rate_ratio;
  return Waves<3>(rates, dt, t);
}

Vec3 Vehicle6::gust(const Waves<3>& at) const {
  const double a = disturbance_m_s2;
  return {a * at.s[0], a * at.c[1], a * at.s[2]};
}

Vehicle6::State Vehicle6::rates(const Vec3& gust, const State& x, const Vec3& force) const {
  const auto R = rotation(x);
  const Six s{x[7], x[8], x[9], x[10], x[11], x[12]}, m = inertia(), drag = damping(s);
  const auto C = coriolis(s);
  const double p = s[3], q = s[4], r = s[5], lever = fin_moments > 0.5 ? fin_moment_n_m / fin_force_n : 0.0;
  Six push{force[0], force[1], force[2], 0.0, lever * force[2], -lever * force[1]};
  // the centre of gravity lies metacentre_m below the centre of buoyancy: moment r_G x W
  const Vec3 down = to_body(R, {0.0, 0.0, 1.0});
  push[3] -= metacentre_m * weight_n * down[1];
  push[4] += metacentre_m * weight_n * down[0];
  const Vec3 xi = to_body(R, gust);
  State out{};
  const Vec3 moved = to_world(R, {s[0], s[1], s[2]});
  for (int i = 0; i < 3; ++i) out[i] = moved[i];
  out[3] = 0.5 * (-x[4] * p - x[5] * q - x[6] * r);
  out[4] = 0.5 * (x[3] * p + x[5] * r - x[6] * q);
  out[5] = 0.5 * (x[3] * q - x[4] * r + x[6] * p);
  out[6] = 0.5 * (x[3] * r + x[4] * q - x[5] * p);
  for (int i = 0; i < 6; ++i) {
    double turn = 0.0;
    for (int j = 0; j < 6; ++j) turn += C[i][j] * s[j];
    out[7 + i] = (push[i] - turn - drag[i]) / m[i] + (i < 3 ? xi[i] : 0.0);
  }
  return out;
}

double Vehicle6::energy(const State& x) const {
  const Six m = inertia();
  double sum = 0.0;
  for (int i = 0; i < 6; ++i) sum += 0.5 * m[i] * x[7 + i] * x[7 + i];
  return sum + metacentre_m * weight_n * (1.0 - rotation(x)[2][2]);
}

std::array<Vec3, 3> Vehicle6::reference(double t) const {
  const double w = turn_rad_s, s = std::sin(w * t), c = std::cos(w * t), a = turn_radius_m, d = dive_m;
  return {Vec3{a * s, a * (1 - c), d * (1 - c)}, Vec3{w * a * c, w * a * s, w * d * s},
          Vec3{-w * w * a * s, w * w * a * c, w * w * d * c}};
}

Outcome swim(const Vehicle6& plant, control::Law& position, const std::vector<double>& noise) {
  const double h = plant.step_s;
  const int ticks = static_cast<int>(plant.duration_s / h),
            every = std::max(1, static_cast<int>(std::lround(plant.sample_s / h)));
  Tally tally({plant.duration_s, h, plant.settle_s, plant.early_s, plant.give_up_m, every});
  const auto make = [&plant] {
    return control::SuperTwisting(plant.differentiator_bound_m_s2, plant.differentiator_l1,
                                  plant.differentiator_l0, plant.differentiator_implicit > 0.5);
  };
  std::array<control::SuperTwisting, 3> differ{make(), make(), make()};
  Vehicle6::State x{};
  x[0] = plant.start_x_m;
  x[1] = plant.start_y_m;
  x[2] = plant.start_z_m;
  x[3] = 1.0;
  x[7] = plant.start_u_m_s;
  const Vehicle6::Six inertia = plant.inertia();
  Waves<3> waves = plant.waves(0.5 * h);
  Vec3 now = plant.gust(waves);
  Vec3 before{};
  double miss2 = 0.0, last_s = 0.0;
  for (int k = 0; k < ticks; ++k) {
    const double t = k * h;
    const auto ref = plant.reference(t);
    const auto R = rotation(x);
    const Vec3 moved = to_world(R, {x[7], x[8], x[9]});
    Vec3 e, rate, estimate;
    Vec p{}, q{};
    for (int i = 0; i < 3; ++i) {
      const std::size_t at = static_cast<std::size_t>(k) * 3 + i;
      e[i] = x[i] - ref[0][i];
      rate[i] = moved[i] - ref[1][i];
      p[i] = e[i] + (at < noise.size() ? plant.noise_m * noise[at] : 0.0);
      if (k == 0) differ[i].reset(e[i], 0.0);
      estimate[i] = differ[i].step(p[i], h);
      q[i] = plant.estimated_rate > 0.5 ? estimate[i] : rate[i];
    }
    if (k == 0) position.reset(p, q);
    const Vec w = position.output(t, p, q, h);
    position.advance(h);
    Vec3 a;
    for (int i = 0; i < 3; ++i) {
      a[i] = plant.reference_feed_forward * ref[2][i] + w[i];
      if (plant.control_kept > 0.5 && k > 0) a[i] -= (estimate[i] - before[i]) / h;  // (6.27) as printed
    }
    before = estimate;
    Vec3 force = to_body(R, a);
    for (int i = 0; i < 3; ++i) {
      force[i] = clip(force[i] * (plant.bare_mass > 0.5 ? plant.mass_kg : inertia[i]), plant.force_max_n);
    }
    const Vec3 u{force[0], force[1] / plant.fin_force_n, force[2] / plant.fin_force_n};
    if (!tally.add(t, e, dot(u, u))) break;
    Outcome& out = tally.out;
    for (const double part : force) out.peak = std::max(out.peak, std::abs(part));
    out.s_max[0] = std::max(out.s_max[0], position.s_norm());
    if (t > plant.settle_s) {
      out.tilt_late = std::max(out.tilt_late, std::asin(std::min(1.0, std::abs(R[2][0]))));
      for (int i = 0; i < 3; ++i) miss2 += h * (estimate[i] - rate[i]) * (estimate[i] - rate[i]);
      last_s = t - plant.settle_s + h;
    }
    if (k % every == 0) {
      out.samples.insert(out.samples.end(),
                         {t, x[0], x[1], x[2], ref[0][0], ref[0][1], ref[0][2], std::sqrt(dot(e, e)), out.ise,
                          std::abs(e[0]) + std::abs(e[1]) + std::abs(e[2]), dot(u, u), position.s_norm()});
    }
    waves.advance();
    const Vec3 middle = plant.gust(waves);
    waves.advance();
    const Vec3 last = plant.gust(waves);
    x = rk4(
        [&](double at, const Vehicle6::State& y) {
          const double done = (at - t) / h;
          return plant.rates(done < 0.25 ? now : done < 0.75 ? middle : last, y, force);
        },
        t, x, h);
    now = last;
    const double length = std::sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5] + x[6] * x[6]);
    for (int i = 3; i < 7; ++i) x[i] /= length;
  }
  if (last_s > 0.0) tally.out.rate_rms = std::sqrt(miss2 / last_s);
  tally.finish();
  return tally.out;
}

}  // namespace chapters
