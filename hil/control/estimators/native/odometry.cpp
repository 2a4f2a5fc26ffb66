#include "odometry.hpp"

#include <algorithm>
#include <cmath>

namespace estimator {

std::int32_t counts_between(std::int32_t old, std::int32_t fresh) {
  const std::uint32_t step = static_cast<std::uint32_t>(fresh) - static_cast<std::uint32_t>(old);
  return static_cast<std::int32_t>(step);
}

void CommandHistory::add(double t_s, const Sides& omega_rad_s) {
  while (commands_.size() > 1 && commands_.back().t_s >= t_s) commands_.pop_back();
  commands_.push_back({t_s, omega_rad_s});
}

void CommandHistory::forget_before(double t_s) {
  while (commands_.size() > 1 && commands_[1].t_s <= t_s) commands_.pop_front();
}

void CommandHistory::segments(double t0_s, double t1_s, std::vector<Piece>& pieces) const {
  pieces.clear();
  for (auto command = commands_.begin(); command != commands_.end(); ++command) {
    const auto next = command + 1;
    const double begin = std::max(command->t_s, t0_s);
    const double end = next == commands_.end() ? t1_s : std::min(next->t_s, t1_s);
    if (end > begin) pieces.push_back({end - begin, command->omega_rad_s});
  }
}

WheelSpeeds::WheelSpeeds(double lag_s, double sigma_accel_rad_s2, double sigma_short_rad_s15, double unit_rad)
    : lag_(lag_s), q_speed_(sigma_accel_rad_s2 * sigma_accel_rad_s2),
      q_short_(sigma_short_rad_s15 * sigma_short_rad_s15), r_(unit_rad * unit_rad / 12.0) {
  restart();
}

void WheelSpeeds::restart() {
  offset_ = omega_ = short_ = {0.0, 0.0};
  p_ = {r_, 0.0, 0.0, 1.0, 0.0, 1.0};
}

WheelSpeeds::Ahead WheelSpeeds::ahead(const std::vector<Piece>& pieces) const {
  Ahead out{{0.0, 0.0}, omega_};
  for (const Piece& piece : pieces) {
    const double fade = std::exp(-piece.duration_s / lag_);
    const double reach = lag_ * (1.0 - fade);
    for (int side = 0; side < 2; ++side) {
      const double goal = piece.omega_rad_s[side] - short_[side];
      const double gap = out.omega_rad_s[side] - goal;
      out.angle_rad[side] += goal * piece.duration_s + gap * reach;
      out.omega_rad_s[side] = goal + gap * fade;
    }
  }
  return out;
}

void WheelSpeeds::step(double dt_s, const Sides& turned_rad, const std::vector<Piece>& pieces) {
  const Ahead expected = ahead(pieces);
  const double f = std::exp(-dt_s / lag_);
  const double g = lag_ * (1.0 - f);  // angle from one unit of speed, and dt - g from a shortfall
  const double b = -(dt_s - g);
  const double c = -(1.0 - f);
  const auto [p00, p01, p02, p11, p12, p22] = p_;
  // F = [[1, g, b], [0, f, c], [0, 0, 1]]; P = F P F' + Q
  const double r0 = p00 + g * p01 + b * p02, r1 = p01 + g * p11 + b * p12, r2 = p02 + g * p12 + b * p22;
  const double t1 = f * p11 + c * p12, t2 = f * p12 + c * p22;
  const double q = q_speed_ * dt_s * dt_s;
  const double n00 = r0 + g * r1 + b * r2 + 0.25 * q * dt_s * dt_s;
  const double n01 = f * r1 + c * r2 + 0.5 * q * dt_s;
  const double n11 = f * t1 + c * t2 + q;
  const double n22 = p22 + q_short_ * dt_s;
  const double k = 1.0 / (n00 + r_);
  for (int side = 0; side < 2; ++side) {
    const double error = offset_[side] + expected.angle_rad[side] - turned_rad[side];
    offset_[side] = error * (1.0 - n00 * k);
    omega_[side] = expected.omega_rad_s[side] - n01 * k * error;
    short_[side] -= r2 * k * error;
  }
  p_ = {n00 * (1.0 - n00 * k), n01 * (1.0 - n00 * k), r2 * (1.0 - n00 * k),
        n11 - n01 * n01 * k,   t2 - n01 * r2 * k,     n22 - r2 * r2 * k};
}

}  // namespace estimator
