// Pinhole camera with five or eight terms of distortion over a floor: vision/camera.py, for the inner loops.
// World axes and metres, pixels with (0, 0) at the centre of the first; NaN where there is no answer.
#pragma once

#include <array>

#include "fused_matrix.hpp"

namespace vision {

struct Vec2 {
  double x = 0.0;
  double y = 0.0;
};

inline Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
inline Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
inline Vec2 operator*(double k, Vec2 a) { return {k * a.x, k * a.y}; }
inline double dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }

struct Camera {
  std::array<double, 4> lens;        // fx, fy, cx, cy, px
  std::array<double, 5> distortion;  // k1, k2, p1, p2, k3
  std::array<double, 9> rotation;    // R_world_cam, row by row
  std::array<double, 3> centre_m;    // t_world_cam
  bool fisheye = false;              // radial terms of the angle from the axis
  std::array<double, 3> below{};     // k4, k5, k6 of a rational lens, 0 for none
  bool rational = below != std::array<double, 3>{};

  // The pixel of a world point.
  Vec2 project(Vec2 point_m, double z_m) const;
  // Where the ray of a pixel meets the plane z = height.
  Vec2 floor_point(Vec2 px, double height_m) const;
  // The same, and d(X, Y)/d(u, v) in m/px, in the roundings of vision/camera.py.
  Vec2 floor_spot(Vec2 px, double height_m) const;
  Dense<2, 2> floor_slope(Vec2 px, double height_m) const;

 private:
  struct Radial {
    double factor;
    double slope;  // (d factor / dr) / r
  };
  Radial fisheye_radial(double r2) const;
  Radial rational_radial(double r2) const;
  Radial bend(double r2) const;
  Vec2 distort(Vec2 at) const;
  // d(distorted)/d(undistorted): xx, xy = yx, yy.
  std::array<double, 3> distort_slope(Vec2 at) const;
  Vec2 normalise(Vec2 px) const;
};

}  // namespace vision
