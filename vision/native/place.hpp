// From two discs in the picture to the robot's pose on the floor, with what it claims (vision/pose_fit.py).
// World axes, m and rad.
#pragma once

#include <array>

#include "camera.hpp"
#include "fused_matrix.hpp"

namespace vision {

// Where a mark is on its plane, and the covariance of that, m^2.
struct Spot {
  Vec2 at_m;
  Dense<2, 2> spread_m2;
};

// `covariance_px2` is uu, uv, vv of the pixel.
Spot spot(const Camera& camera, Vec2 px, const std::array<double, 3>& covariance_px2, double height_m);

// Variance of the distance of two spots that are `length_m` apart, m^2.
double gap_variance(const Spot& one, const Spot& other, double length_m);

// The pose that takes two points of the robot to their spots, each weighted by its covariance; theta is not wrapped.
// `left` is the weighted sum of squares that is left, with one degree of freedom.
struct Placed {
  double x_m, y_m, theta_rad;
  Dense<3, 3> covariance;
  double left;
};
Placed weighted_pose(const std::array<Vec2, 2>& body_m, const std::array<Spot, 2>& spots);

}  // namespace vision
