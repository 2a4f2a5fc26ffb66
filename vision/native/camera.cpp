#include "camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vision {
namespace {

constexpr int kNewtonSteps = 20;
constexpr double kNewtonTolerance = 1e-13;
constexpr double kSmallR2 = 1e-10;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Camera::Radial Camera::fisheye_radial(double r2) const {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const double r = std::sqrt(std::max(r2, kSmallR2));
  const double theta = std::atan(r);
  const double t2 = theta * theta;
  const double factor = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * k3))) / r;
  const double rise = (1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * 7.0 * k3))) / (1.0 + r * r);
  return {factor, (rise - factor) / (r * r)};
}

Camera::Radial Camera::rational_radial(double r2) const {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const auto& [k4, k5, k6] = below;
  const double over = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double over_slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
  const double under = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
  const double under_slope = 2.0 * (k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6));
  const double factor = over / under;
  return {factor, (over_slope - factor * under_slope) / under};
}

Camera::Radial Camera::bend(double r2) const {
  if (rational) {
    return rational_radial(r2);
  }
  const auto& [k1, k2, p1, p2, k3] = distortion;
  return fisheye
             ? fisheye_radial(r2)
             : Radial{1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)), 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))};
}

std::array<double, 3> Camera::distort_slope(Vec2 at) const {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const auto [radial, slope] = bend(at.x * at.x + at.y * at.y);
  const double cross = at.x * at.y * slope + 2.0 * p1 * at.x + 2.0 * p2 * at.y;
  return {radial + at.x * at.x * slope + 2.0 * p1 * at.y + 6.0 * p2 * at.x, cross,
          radial + at.y * at.y * slope + 6.0 * p1 * at.y + 2.0 * p2 * at.x};
}

Vec2 Camera::distort(Vec2 at) const {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const double r2 = at.x * at.x + at.y * at.y;
  const double radial = rational  ? rational_radial(r2).factor
                        : fisheye ? fisheye_radial(r2).factor
                                  : 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double xy2 = 2.0 * at.x * at.y;
  return {at.x * radial + p1 * xy2 + p2 * (r2 + 2.0 * at.x * at.x),
          at.y * radial + p1 * (r2 + 2.0 * at.y * at.y) + p2 * xy2};
}

Vec2 Camera::project(Vec2 point_m, double z_m) const {
  const auto& r = rotation;
  const double dx = point_m.x - centre_m[0];
  const double dy = point_m.y - centre_m[1];
  const double dz = z_m - centre_m[2];
  const double zc = r[2] * dx + r[5] * dy + r[8] * dz;
  if (!(zc > 0.0)) {
    return {kNaN, kNaN};
  }
  const Vec2 d =
      distort({(r[0] * dx + r[3] * dy + r[6] * dz) / zc, (r[1] * dx + r[4] * dy + r[7] * dz) / zc});
  return {lens[0] * d.x + lens[2], lens[1] * d.y + lens[3]};
}

Vec2 Camera::normalise(Vec2 px) const {
  const Vec2 target = {(px.x - lens[2]) / lens[0], (px.y - lens[3]) / lens[1]};
  Vec2 at = target;
  for (int step = 0; step < kNewtonSteps; ++step) {
    const Vec2 rest = target - distort(at);
    const auto [xx, cross, yy] = distort_slope(at);
    const double det = xx * yy - cross * cross;
    const Vec2 move = {(yy * rest.x - cross * rest.y) / det, (xx * rest.y - cross * rest.x) / det};
    at = at + move;
    if (std::abs(move.x) + std::abs(move.y) < kNewtonTolerance) {
      return at;
    }
  }
  return {kNaN, kNaN};
}

Vec2 Camera::floor_point(Vec2 px, double height_m) const {
  const Vec2 at = normalise(px);
  const auto& r = rotation;
  const double dz = r[6] * at.x + r[7] * at.y + r[8];
  const double reach = (height_m - centre_m[2]) / dz;
  if (!(reach > 0.0)) {
    return {kNaN, kNaN};
  }
  return {centre_m[0] + reach * (r[0] * at.x + r[1] * at.y + r[2]),
          centre_m[1] + reach * (r[3] * at.x + r[4] * at.y + r[5])};
}

Vec2 Camera::floor_spot(Vec2 px, double height_m) const {
  const Vec2 at = normalise(px);
  const auto& r = rotation;
  const double dz = r[6] * at.x + r[7] * at.y + r[8];
  if (!(dz < 0.0)) {
    return {kNaN, kNaN};
  }
  const double drop = height_m - centre_m[2];
  return {centre_m[0] + drop * ((r[0] * at.x + r[1] * at.y + r[2]) / dz),
          centre_m[1] + drop * ((r[3] * at.x + r[4] * at.y + r[5]) / dz)};
}

Dense<2, 2> Camera::floor_slope(Vec2 px, double height_m) const {
  const Vec2 at = normalise(px);
  const auto& r = rotation;
  const double dx = r[0] * at.x + r[1] * at.y + r[2];
  const double dy = r[3] * at.x + r[4] * at.y + r[5];
  const double dz = r[6] * at.x + r[7] * at.y + r[8];
  const double drop = (height_m - centre_m[2]) / (dz * dz);
  const Dense<2, 2> plane = {{{drop * (r[0] * dz - r[6] * dx), drop * (r[1] * dz - r[7] * dx)},
                              {drop * (r[3] * dz - r[6] * dy), drop * (r[4] * dz - r[7] * dy)}}};
  const auto [xx, cross, yy] = distort_slope(at);
  const double det = xx * yy - cross * cross;
  Dense<2, 2> slope =
      product(plane, Dense<2, 2>{{{yy / lens[0], -cross / lens[1]}, {-cross / lens[0], xx / lens[1]}}});
  for (auto& row : slope) {
    for (double& value : row) {
      value /= det;
    }
  }
  return slope;
}

}  // namespace vision
