#include "vehicle5.hpp"

#include "signals.hpp"

namespace chapters {

using control::Vec;

namespace {

struct Rotation {  // body to world, roll 0
  double ct, st, cp, sp;
  Rotation(double theta, double psi)
      : ct(std::cos(theta)), st(std::sin(theta)), cp(std::cos(psi)), sp(std::sin(psi)) {}
  Vec3 to_world(const Vec3& b) const {
    return {ct * cp * b[0] - sp * b[1] + st * cp * b[2], ct * sp * b[0] + cp * b[1] + st * sp * b[2],
            -st * b[0] + ct * b[2]};
  }
  Vec3 to_body(const Vec3& w) const {
    return {ct * cp * w[0] + ct * sp * w[1] - st * w[2], -sp * w[0] + cp * w[1],
            st * cp * w[0] + st * sp * w[1] + ct * w[2]};
  }
};

}  // namespace

Waves<8> Vehicle5::waves(double dt, double t) const {
  std::array<double, 8> rates{0.7, 0.5, 0.9, 1.1, 0.8, 0.6, 0.9, 1.3};
  for (double& rate : rates) rate *= disturbance_rate_ratio;
  return Waves<8>(rates, dt, t);
}

Vehicle5::Gust Vehicle5::gust(const Waves<8>& at) const {
  const double kin = velocity_disturbance_m_s, acc = accel_disturbance_m_s2;
  return {{kin * at.s[0], kin * at.c[1], kin * at.s[2]},
          {acc * at.s[3], acc * at.c[4], acc * at.s[5]},
          {acc * at.c[6], acc * at.s[7]}};
}

Vehicle5::State Vehicle5::rates(const Gust& gust, const State& x, const Vec3& torque,
                                const Vec3& volt) const {
  const double theta = x[3], u = x[5], v = x[6], w = x[7], q = x[8], r = x[9];
  const Rotation turn(theta, x[4]);
  const Vec3 moved = turn.to_world({u, v, w});
  const bool driven = motor > 0.5;
  Vec3 push = torque;
  if (driven) {
    for (int i = 0; i < 3; ++i) push[i] = motor_gain_n_a * x[10 + i];
  }
  State out{};
  out[0] = moved[0] + gust.moved[0];
  out[1] = moved[1] + gust.moved[1];
  out[2] = moved[2] + gust.moved[2];
  out[3] = q;
  out[4] = r / turn.ct;
  out[5] = (m22_kg * v * r - m33_kg * w * q - d11_kg_s * u + push[0]) / m11_kg + gust.pushed[0];
  out[6] = (-m11_kg * u * r - d22_kg_s * v) / m22_kg + gust.pushed[1];
  out[7] = (m11_kg * u * q - d33_kg_s * w) / m33_kg + gust.pushed[2];
  out[8] = ((m33_kg - m11_kg) * u * w - d55_kg_m2_s * q - righting_n_m() * turn.st + push[1]) / m55_kg_m2 +
           gust.turned[0];
  out[9] = ((m11_kg - m22_kg) * u * v - d66_kg_m2_s * r + push[2]) / m66_kg_m2 + gust.turned[1];
  if (driven) {
    const Vec3 speed{u, q, r};
    for (int i = 0; i < 3; ++i) {
      out[10 + i] =
          (volt[i] - motor_resistance_ohm * x[10 + i] - motor_emf_v_s_m * speed[i]) / motor_inductance_h;
    }
  }
  return out;
}

double Vehicle5::energy(const State& x) const {
  return 0.5 * (m11_kg * x[5] * x[5] + m22_kg * x[6] * x[6] + m33_kg * x[7] * x[7] + m55_kg_m2 * x[8] * x[8] +
                m66_kg_m2 * x[9] * x[9]) +
         righting_n_m() * (1.0 - std::cos(x[3]));
}

std::array<Vec3, 3> Vehicle5::reference(double t) const {
  const double w = 0.02, s = std::sin(w * t), c = std::cos(w * t), b = 0.01 * t - 2.0, b2 = b * b,
               b6 = b2 * b2 * b2;
  const double d = 1.0 + b6 * b2, d1 = 0.08 * b6 * b, d2 = 56e-4 * b6;  // of 1 + (0.01 t - 2)^8
  return {Vec3{15.0 * s, 15.0 * c, -5.0 / d}, Vec3{15.0 * w * c, -15.0 * w * s, 5.0 * d1 / (d * d)},
          Vec3{-15.0 * w * w * s, -15.0 * w * w * c, 5.0 * (d2 / (d * d) - 2.0 * d1 * d1 / (d * d * d))}};
}

namespace {

Vec pack(const Vec3& a) { return {a[0], a[1], a[2]}; }

double away_from_zero(double x, double floor) { return std::abs(x) > floor ? x : x >= 0.0 ? floor : -floor; }

struct Wanted {
  double surge, pitch_rate, yaw_rate;
};

// The cascade; one object runs one vehicle.
class Cascade {
 public:
  Cascade(const Vehicle5& plant, control::Law& position, control::Law& sideways, control::Law& drive)
      : plant_(plant), position_(position), sideways_(sideways), drive_(drive),
        lag_{control::LowPass(plant.command_lag_s), control::LowPass(plant.command_lag_s),
             control::LowPass(plant.command_lag_s)},
        differ_{make_differ(), make_differ(), make_differ()} {}

  // Stages 1 to 3: torques for the state; `error` is the position error of the tick.
  Vec3 torque(double t, const Vehicle5::State& x, const Vec3& error, const std::array<Vec3, 3>& ref) {
    const Rotation turn(x[3], x[4]);
    first_ = t == 0.0;
    const auto [velocity, accel] = position_stage(t, x, error, ref, turn);
    const Wanted wanted = sideways_stage(t, x, turn.to_body(velocity), turn.to_body(accel));
    return drive_stage(t, x, wanted);
  }
  const Vec3& integral() const { return p1_; }

 private:
  control::SuperTwisting make_differ() const { return {plant_.differentiator_bound_m_s2, 1.5, 1.1, true}; }

  // The wanted velocity and acceleration in world axes. The correction y is limited smoothly in
  // length, and the integrals wait while it is.
  std::pair<Vec3, Vec3> position_stage(double t, const Vehicle5::State& x, const Vec3& error,
                                       const std::array<Vec3, 3>& ref, const Rotation& turn) {
    const double h = plant_.step_s, limit = plant_.correction_max_m_s;
    if (first_) position_.reset(pack(p1_), pack(error));
    const Vec w = position_.output(t, pack(p1_), pack(error), h);
    const Vec3 moved = turn.to_world({x[5], x[6], x[7]});  // without the disturbance, which is unknown
    Vec rate{};
    for (int i = 0; i < 3; ++i) rate[i] = moved[i] - ref[1][i];
    const Vec w_dot = position_.rate(rate);
    const Vec3 y{w[0], w[1], w[2]}, y_dot{w_dot[0], w_dot[1], w_dot[2]};
    const double size2 = dot(y, y), f = 1.0 / std::sqrt(1.0 + size2 / (limit * limit));
    const double f_dot = -f * f * f * dot(y, y_dot) / (limit * limit);
    std::pair<Vec3, Vec3> out;
    for (int i = 0; i < 3; ++i) {
      out.first[i] = ref[1][i] + f * y[i];
      out.second[i] = ref[2][i] + f * y_dot[i] + f_dot * y[i];
      if (plant_.feed_differentiator > 0.5) {
        if (first_) differ_[i].reset(out.first[i], ref[2][i]);
        out.second[i] = differ_[i].step(out.first[i], h);
      }
    }
    if (size2 < limit * limit) {
      position_.advance(h);
      for (int i = 0; i < 3; ++i) p1_[i] += h * error[i];
    }
    return out;
  }

  Wanted sideways_stage(double t, const Vehicle5::State& x, const Vec3& wish, const Vec3& wish_dot) {
    const double h = plant_.step_s, theta = x[3], u = x[5], v = x[6], w = x[7];
    const double us = std::clamp(wish[0], plant_.surge_min_m_s, plant_.surge_max_m_s);
    const double vs = clip(wish[1], plant_.side_max_m_s), ws = clip(wish[2], plant_.side_max_m_s);
    const Vec p{p2_[0], p2_[1]}, q{v - vs, w - ws};
    if (first_) sideways_.reset(p, q);
    const Vec want = sideways_.output(t, p, q, h);
    sideways_.advance(h);
    for (int i = 0; i < 2; ++i) p2_[i] += h * q[i];
    const double ratio2 = plant_.m11_kg / plant_.m22_kg, ratio3 = plant_.m11_kg / plant_.m33_kg;
    double pitch_rate, yaw_rate;
    if (plant_.effective_gain > 0.5) {
      // d(v - v*)/dt = r (u* + w* tan - m11/m22 u) - d22/m22 v - (R' dV*/dt)_2, likewise w; the
      // gains are positive and negative at u = u*, and are kept away from zero
      const double tan = std::tan(theta), floor = plant_.gain_floor_m_s;
      double gain_r = us + ws * tan - ratio2 * u, gain_q = ratio3 * u - us;
      if (std::abs(gain_r) <= floor) gain_r = floor;
      if (std::abs(gain_q) <= floor) gain_q = -floor;
      yaw_rate = (want[0] + plant_.d22_kg_s / plant_.m22_kg * v + wish_dot[1]) / gain_r;
      pitch_rate =
          (want[1] + plant_.d33_kg_s / plant_.m33_kg * w + wish_dot[2] + yaw_rate * tan * vs) / gain_q;
    } else {  // as printed, (7.17): the turning of v*, w* left out
      const double along = away_from_zero(u, plant_.gain_floor_m_s);
      pitch_rate = want[1] / (ratio3 * along);
      yaw_rate = want[0] / (-ratio2 * along);
    }
    yaw_rate = clip(yaw_rate, plant_.turn_rate_max_rad_s);
    pitch_rate = clip(pitch_rate, plant_.turn_rate_max_rad_s);
    pitch_rate =
        std::min(std::max(pitch_rate, -(theta + plant_.pitch_max_rad)), plant_.pitch_max_rad - theta);
    return {us, pitch_rate, yaw_rate};
  }

  Vec3 drive_stage(double t, const Vehicle5::State& x, const Wanted& wanted) {
    const double h = plant_.step_s, u = x[5], v = x[6], w = x[7], q = x[8], r = x[9];
    const Vec3 command{wanted.surge, wanted.pitch_rate, wanted.yaw_rate}, speed{u, q, r};
    Vec rate{}, error{};
    for (int i = 0; i < 3; ++i) {
      if (first_) lag_[i].reset(command[i]);
      rate[i] = lag_[i].step(command[i], h);
      error[i] = speed[i] - lag_[i].value();
    }
    if (first_) drive_.reset(pack(p3_), error);
    const Vec a = drive_.output(t, pack(p3_), error, h);
    drive_.advance(h);
    for (int i = 0; i < 3; ++i) p3_[i] += h * error[i];
    const Vehicle5& p = plant_;
    return {p.m11_kg * (rate[0] + a[0]) - p.m22_kg * v * r + p.m33_kg * w * q + p.d11_kg_s * u,
            p.m55_kg_m2 * (rate[1] + a[1]) - (p.m33_kg - p.m11_kg) * u * w + p.d55_kg_m2_s * q +
                p.righting_n_m() * std::sin(x[3]),
            p.m66_kg_m2 * (rate[2] + a[2]) - (p.m11_kg - p.m22_kg) * u * v + p.d66_kg_m2_s * r};
  }

  const Vehicle5& plant_;
  control::Law &position_, &sideways_, &drive_;
  std::array<control::LowPass, 3> lag_;
  std::array<control::SuperTwisting, 3> differ_;
  Vec3 p1_{}, p3_{};
  std::array<double, 2> p2_{};
  bool first_ = true;
};

// Voltages that bring the currents to torque / gain with the rate motor_loop_rad_s.
Vec3 voltage(const Vehicle5& plant, const Vehicle5::State& x, const Vec3& torque) {
  const Vec3 speed{x[5], x[8], x[9]};
  Vec3 out;
  for (int i = 0; i < 3; ++i) {
    out[i] =
        plant.motor_resistance_ohm * x[10 + i] + plant.motor_emf_v_s_m * speed[i] -
        plant.motor_inductance_h * plant.motor_loop_rad_s * (x[10 + i] - torque[i] / plant.motor_gain_n_a);
  }
  return out;
}

}  // namespace

Outcome dive(const Vehicle5& plant, control::Law& position, control::Law& sideways, control::Law& drive) {
  const double h = plant.step_s;
  const int ticks = static_cast<int>(plant.duration_s / h),
            every = std::max(1, static_cast<int>(std::lround(plant.sample_s / h)));
  Tally tally({plant.duration_s, h, plant.settle_s, plant.early_s, plant.give_up_m, every});
  Cascade cascade(plant, position, sideways, drive);
  Vehicle5::State x{};
  x[0] = plant.start_x_m;
  x[1] = plant.start_y_m;
  x[2] = plant.start_z_m;
  x[5] = plant.start_u_m_s;
  const bool driven = plant.motor > 0.5;
  Waves<8> waves = plant.waves(0.5 * h);
  Vehicle5::Gust now = plant.gust(waves);
  for (int k = 0; k < ticks; ++k) {
    const double t = k * h;
    const auto ref = plant.reference(t);
    const Vec3 error{x[0] - ref[0][0], x[1] - ref[0][1], x[2] - ref[0][2]};
    const Vec3 torque = cascade.torque(t, x, error, ref);
    if (!tally.add(t, error, dot(torque, torque))) break;
    Outcome& out = tally.out;
    for (const double part : torque) out.peak = std::max(out.peak, std::abs(part));
    out.s_max = {std::max(out.s_max[0], position.s_norm()), std::max(out.s_max[1], sideways.s_norm()),
                 std::max(out.s_max[2], drive.s_norm())};
    out.integral_cost = 0.0;
    for (const double part : cascade.integral()) out.integral_cost += std::abs(part);
    if (t > plant.settle_s) out.tilt_late = std::max(out.tilt_late, std::abs(x[3]));
    if (k % every == 0) {
      out.samples.insert(out.samples.end(),
                         {t, x[0], x[1], x[2], ref[0][0], ref[0][1], ref[0][2], std::sqrt(dot(error, error)),
                          out.ise, x[5], x[6], x[7], x[8], x[9], torque[0], torque[1], torque[2]});
    }
    const Vec3 volt = driven ? voltage(plant, x, torque) : Vec3{};
    waves.advance();
    const Vehicle5::Gust middle = plant.gust(waves);
    waves.advance();
    const Vehicle5::Gust last = plant.gust(waves);
    x = rk4(
        [&](double at, const Vehicle5::State& y) {
          const double done = (at - t) / h;
          return plant.rates(done < 0.25 ? now : done < 0.75 ? middle : last, y, torque, volt);
        },
        t, x, h);
    now = last;
    if (std::abs(x[3]) > 1.55) {  // 0.02 rad short of 90 degrees, where r/cos(theta) ends
      tally.out.end_s = t + h;
      tally.stop(End::tumbled);
      break;
    }
  }
  tally.finish();
  return tally.out;
}

}  // namespace chapters
