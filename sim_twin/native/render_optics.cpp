// Lens and pose of the rendered camera, pixel to floor and back.
#include <algorithm>
#include <cmath>

#include "render.hpp"

namespace camera {
namespace {

// The factor by which the lens moves a normalised point away from the axis.
double radial_factor(const View& view, double r2) {
  const auto [k1, k2, p1, p2, k3] = view.dist;
  if (!view.fisheye) {
    const auto [k4, k5, k6] = view.below;
    return (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)));
  }
  const double r = std::sqrt(std::max(r2, 1e-10)), theta = std::atan(r), t2 = theta * theta;
  return theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * k3))) / r;
}

}  // namespace

void undistort(const View& view, double u, double v, double& x, double& y) {
  const double xd = (u - view.cx) / view.fx, yd = (v - view.cy) / view.fy;
  const auto [k1, k2, p1, p2, k3] = view.dist;
  x = xd;
  y = yd;
  for (int i = 0; i < 200; ++i) {
    const double r2 = x * x + y * y;
    const double radial = radial_factor(view, r2);
    const double nx = (xd - (2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x))) / radial;
    const double ny = (yd - (p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y)) / radial;
    const double step = std::fabs(nx - x) + std::fabs(ny - y);
    x = nx;
    y = ny;
    if (step < 1e-11) break;  // 1e-8 px
  }
}

bool project(const View& view, double x, double y, double z, double& u, double& v) {
  const double d[3] = {x - view.t[0], y - view.t[1], z - view.t[2]};
  double c[3];
  for (int i = 0; i < 3; ++i) c[i] = view.R[i] * d[0] + view.R[3 + i] * d[1] + view.R[6 + i] * d[2];
  if (c[2] <= 1e-6) return false;
  const double a = c[0] / c[2], b = c[1] / c[2], r2 = a * a + b * b;
  const auto [k1, k2, p1, p2, k3] = view.dist;
  const double radial = radial_factor(view, r2);
  u = view.cx + view.fx * (a * radial + 2.0 * p1 * a * b + p2 * (r2 + 2.0 * a * a));
  v = view.cy + view.fy * (b * radial + p1 * (r2 + 2.0 * b * b) + 2.0 * p2 * a * b);
  return true;
}

Sight line_of_sight(const View& view, double u, double v) {
  double x, y;
  undistort(view, u, v, x, y);
  double d[3];
  for (int i = 0; i < 3; ++i) d[i] = view.R[3 * i] * x + view.R[3 * i + 1] * y + view.R[3 * i + 2];
  if (!(d[2] < -1e-3)) d[2] = -1e-3;  // level or upwards: far away on the floor, in its colour
  const double lx = d[0] / d[2], ly = d[1] / d[2];
  return {static_cast<float>(view.t[0] - view.t[2] * lx), static_cast<float>(view.t[1] - view.t[2] * ly),
          static_cast<float>(lx), static_cast<float>(ly)};
}

}  // namespace camera
