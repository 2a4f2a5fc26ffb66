#include "filter.hpp"

#include <cmath>

namespace estimator {
namespace {

constexpr double kPi = 3.14159265358979323846;

}  // namespace

double wrap_pi(double angle_rad) {
  constexpr double kWholeTurn_rad = 2.0 * kPi;
  double rest = std::fmod(angle_rad + kPi, kWholeTurn_rad);
  if (rest < 0.0) rest += kWholeTurn_rad;  // fmod has the sign of the angle; the remainder has none
  return rest - kPi;
}

PoseFilter::PoseFilter(const Assumptions& a, double d0_m)
    : walk_{square(a.slip_ratio), square(a.drift_m_s05), square(a.drift_rad_s05), square(a.d0_walk_m_rad05)},
      x_{0.0, 0.0, 0.0, 1.0, 1.0, d0_m} {
  P_[kDistance][kDistance] = P_[kTurn][kTurn] = square(a.sigma_scale);
  P_[kOffset][kOffset] = square(a.sigma_d0_m);
}

void PoseFilter::place(const Pose& pose, double sigma_xy_m, double sigma_theta_rad, const Excess& excess) {
  const double theta = x_[kTheta] + wrap_pi(pose.theta_rad - x_[kTheta]), d0 = x_[kOffset];
  const double c = std::cos(theta), s = std::sin(theta);
  x_[kZ1X] = pose.x_m + d0 * c;
  x_[kZ1Y] = pose.y_m + d0 * s;
  x_[kTheta] = theta;
  const auto [xx, xy, xt, yy, yt, tt] = excess;
  const double var_xy = square(sigma_xy_m), var_theta = square(sigma_theta_rad) + tt;
  const double var_d0 = P_[kOffset][kOffset];
  for (int i : {kZ1X, kZ1Y, kTheta}) {
    for (int j = 0; j < kStates; ++j) P_[i][j] = P_[j][i] = 0.0;
  }
  P_[kTheta][kTheta] = var_theta;
  P_[kZ1X][kZ1X] = P_[kZ1Y][kZ1Y] = var_xy;
  // z1 = pose + d0 e(theta) carries the errors of theta and d0.
  const double by_theta[] = {-d0 * s, d0 * c}, by_d0[] = {c, s}, with_theta[] = {xt, yt};
  const double with[2][2] = {{xx, xy}, {xy, yy}};
  for (int i : {kZ1X, kZ1Y}) {
    P_[i][kTheta] = P_[kTheta][i] = by_theta[i] * var_theta + with_theta[i];
    P_[i][kOffset] = P_[kOffset][i] = by_d0[i] * var_d0;
    for (int j : {kZ1X, kZ1Y}) {
      P_[i][j] += by_theta[i] * by_theta[j] * var_theta + by_d0[i] * by_d0[j] * var_d0;
      P_[i][j] += with[i][j] + by_theta[i] * with_theta[j] + by_theta[j] * with_theta[i];
    }
  }
}

// The point moves along the heading half-way through the turn.
void PoseFilter::move(double dt_s, double forward_m, double turn_rad, double length_m, double angle_rad) {
  const double middle = x_[kTheta] + 0.5 * x_[kTurn] * turn_rad;
  const double c = std::cos(middle), s = std::sin(middle);
  const double step = x_[kDistance] * forward_m;
  // F = 1 + G, with G the rows below on the columns theta, k_d, k_t; P = F P F' + Q.
  struct Row {
    int i;
    double by_theta, by_distance, by_turn;
  };
  const Row rows[] = {
      {kZ1X, -step * s, forward_m * c, -0.5 * step * s * turn_rad},
      {kZ1Y, step * c, forward_m * s, 0.5 * step * c * turn_rad},
      {kTheta, 0.0, 0.0, turn_rad},
  };
  for (const Row& g : rows) {
    for (int j = 0; j < kStates; ++j) {
      P_[g.i][j] = P_[g.i][j] + g.by_theta * P_[kTheta][j] + g.by_distance * P_[kDistance][j] +
                   g.by_turn * P_[kTurn][j];
    }
  }
  for (const Row& g : rows) {
    for (Vector& row : P_) {
      row[g.i] += g.by_theta * row[kTheta] + g.by_distance * row[kDistance] + g.by_turn * row[kTurn];
    }
  }
  const double position_noise = walk_.slip * length_m + walk_.drift_xy * dt_s;
  P_[kZ1X][kZ1X] += position_noise;
  P_[kZ1Y][kZ1Y] += position_noise;
  P_[kTheta][kTheta] += walk_.slip * (length_m + angle_rad) + walk_.drift_theta * dt_s;
  P_[kOffset][kOffset] += walk_.d0 * angle_rad;
  x_[kZ1X] += step * c;
  x_[kZ1Y] += step * s;
  x_[kTheta] += x_[kTurn] * turn_rad;
}

Innovation PoseFilter::innovation(const Pose& pose) const {
  return {pose.x_m - x_[kZ1X] + x_[kOffset] * std::cos(x_[kTheta]),
          pose.y_m - x_[kZ1Y] + x_[kOffset] * std::sin(x_[kTheta]), wrap_pi(pose.theta_rad - x_[kTheta])};
}

// The components are made independent (R = L D L', each less what those before it say of its error), then
// taken one after the other; the sum of their normalised squares is the distance of the whole.
bool PoseFilter::correct(const Innovation& innovation, double var_xy, double var_theta, double gate,
                         const Excess& excess) {
  const double d0 = x_[kOffset], c = std::cos(x_[kTheta]), s = std::sin(x_[kTheta]);
  const auto [xx, xy, xt, yy, yt, tt] = excess;
  std::array<Vector, 3> rows{};  // dh/dx
  rows[0][kZ1X] = rows[1][kZ1Y] = rows[2][kTheta] = 1.0;
  rows[0][kTheta] = d0 * s;
  rows[0][kOffset] = -c;
  rows[1][kTheta] = -d0 * c;
  rows[1][kOffset] = -s;
  Innovation seen = innovation;
  Innovation variance{var_xy + xx, var_xy + yy, var_theta + tt};
  const double yx = xy / variance[0], tx = xt / variance[0];
  variance[1] -= yx * xy;
  const double ty = (yt - tx * xy) / variance[1];
  variance[2] -= tx * xt + ty * ty * variance[1];
  const auto less = [&](int i, double share, int j) {
    seen[i] -= share * seen[j];
    for (int k = 0; k < kStates; ++k) rows[i][k] -= share * rows[j][k];
  };
  less(1, yx, 0);
  less(2, tx, 0);
  less(2, ty, 1);
  Matrix P = P_;
  Vector change{};
  double distance2 = 0.0;
  for (int i = 0; i < 3; ++i) {
    const Vector& h = rows[i];
    Vector ph{};  // P h'
    double left = seen[i], spread = 0.0;
    for (int j = 0; j < kStates; ++j) {
      for (int k = 0; k < kStates; ++k) ph[j] += h[k] * P[j][k];
      left -= h[j] * change[j];
    }
    for (int j = 0; j < kStates; ++j) spread += h[j] * ph[j];
    const double total = spread + variance[i];
    distance2 += left * left / total;
    if (!(distance2 <= gate)) return false;  // NaN too
    for (int j = 0; j < kStates; ++j) {
      const double gain = ph[j] / total;
      change[j] += gain * left;
      for (int k = 0; k < kStates; ++k) P[j][k] -= gain * ph[k];
    }
  }
  P_ = P;
  for (int j = 0; j < kStates; ++j) x_[j] += change[j];
  return true;
}

}  // namespace estimator
