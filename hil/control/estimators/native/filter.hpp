// The extended Kalman filter of the default estimator.
// Frames: world X right, Y up; theta counter-clockwise from +X, unwrapped. SI units, radians.
#pragma once

#include <array>

namespace estimator {

// One list: C++ fields and their Python names, those of EstimatorConfig in hil/config/control.py, where
// every value has its bounds and its reason. A caller must set them all (no defaults).
// clang-format off
#define ESTIMATOR_ASSUMPTIONS(X)                                                               \
  X(double, wheel_lag_s) X(double, sigma_accel_rad_s2) X(double, sigma_short_rad_s15)          \
  X(double, sigma_scale) X(double, sigma_d0_m) X(double, d0_walk_m_rad05)                      \
  X(double, slip_ratio) X(double, drift_m_s05) X(double, drift_rad_s05)                        \
  X(double, sigma_time_s) X(double, gate_chi2) X(int, reacquire_poses) X(double, history_s)
// clang-format on

struct Assumptions {
#define X(type, name) type name = 0;
  ESTIMATOR_ASSUMPTIONS(X)
#undef X
};

struct Pose {
  double x_m, y_m, theta_rad;  // of the centre of mass
};

// Index of each state: flat output point z1 and heading in the world, scales of the distance and turn
// that wheel counts claim, and how far the point lies ahead of the centre of mass that the camera gives.
enum FilterState : int { kZ1X, kZ1Y, kTheta, kDistance, kTurn, kOffset, kStates };

using Vector = std::array<double, kStates>;
using Matrix = std::array<Vector, kStates>;
using Innovation = std::array<double, 3>;  // m, m, rad
// Covariance of a pose less the diagonal of its two sigmas: xx, xy, xt, yy, yt, tt; zero where none is known.
using Excess = std::array<double, 6>;

// The angle wrapped to [-pi, pi); hil.core.types.wrap_pi to the bit.
double wrap_pi(double angle_rad);

inline double square(double x) { return x * x; }

// Mean x and covariance P of [z1_x, z1_y, theta, k_d, k_t, d0] at one instant. d0 shows in how the centre
// of mass moves aside in a turn (2.31).
class PoseFilter {
 public:
  PoseFilter(const Assumptions& assumptions, double d0_m);

  // Starts at a pose; scales and d0 keep what is known of them, theta stays unwrapped.
  void place(const Pose& pose, double sigma_xy_m, double sigma_theta_rad, const Excess& excess = {});

  // Carries mean and covariance over one increment of odometry (believed units) that took dt_s. length_m
  // and angle_rad are its distance and turn with all signs positive: noise grows with what was travelled,
  // not with the net of it.
  void move(double dt_s, double forward_m, double turn_rad, double length_m, double angle_rad);

  // The pose seen minus the pose expected: h(x) = [z1 - d0 e(theta), theta].
  Innovation innovation(const Pose& pose) const;

  // Takes the innovation, unless its squared Mahalanobis distance exceeds the gate (or is no number): then
  // nothing changes and the answer is false.
  bool correct(const Innovation& innovation, double var_xy, double var_theta, double gate,
               const Excess& excess = {});

  const Vector& mean() const { return x_; }
  const Matrix& covariance() const { return P_; }

 private:
  struct WalkVariances {  // what the covariance gains per path, turn or time
    double slip, drift_xy, drift_theta, d0;
  };

  WalkVariances walk_;
  Vector x_;
  Matrix P_{};
};

}  // namespace estimator
