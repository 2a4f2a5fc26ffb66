#include "place.hpp"

#include <cmath>

namespace vision {
namespace {

constexpr int kSteps = 2;  // of Gauss and Newton from the unweighted pose

struct Rigid {
  double x_m, y_m, theta_rad;
};

// The pose that takes points closest to others, all alike.
Rigid unweighted(const std::array<Vec2, 2>& body, const std::array<Spot, 2>& spots) {
  const Vec2 b0 = {(body[0].x + body[1].x) / 2.0, (body[0].y + body[1].y) / 2.0};
  const Vec2 w0 = {(spots[0].at_m.x + spots[1].at_m.x) / 2.0, (spots[0].at_m.y + spots[1].at_m.y) / 2.0};
  double across = 0.0;
  double along = 0.0;
  for (int k = 0; k < 2; ++k) {
    const Vec2 b = body[k] - b0;
    const Vec2 w = spots[k].at_m - w0;
    across += b.x * w.y - b.y * w.x;
    along = along + b.x * w.x;
    along = along + b.y * w.y;
  }
  const double theta_rad = std::atan2(across, along);
  const double c = std::cos(theta_rad);
  const double s = std::sin(theta_rad);
  const std::array<double, 2> turned = applied(Dense<2, 2>{{{c, -s}, {s, c}}}, {b0.x, b0.y});
  return {w0.x - turned[0], w0.y - turned[1], theta_rad};
}

}  // namespace

Spot spot(const Camera& camera, Vec2 px, const std::array<double, 3>& covariance_px2, double height_m) {
  const auto& [uu, uv, vv] = covariance_px2;
  const Dense<2, 2> slope = camera.floor_slope(px, height_m);
  const Dense<2, 2> spread = product(product(slope, Dense<2, 2>{{{uu, uv}, {uv, vv}}}), transposed(slope));
  return {camera.floor_spot(px, height_m), spread};
}

double gap_variance(const Spot& one, const Spot& other, double length_m) {
  const Dense<1, 2> along = {
      {{(one.at_m.x - other.at_m.x) / length_m, (one.at_m.y - other.at_m.y) / length_m}}};
  Dense<2, 2> both;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      both[i][j] = one.spread_m2[i][j] + other.spread_m2[i][j];
    }
  }
  return product(product(along, both), transposed(along))[0][0];
}

Placed weighted_pose(const std::array<Vec2, 2>& body_m, const std::array<Spot, 2>& spots) {
  const std::array<Dense<2, 2>, 2> weight = {inverse_of(spots[0].spread_m2), inverse_of(spots[1].spread_m2)};
  auto [x_m, y_m, theta_rad] = unweighted(body_m, spots);
  Placed found{};
  std::array<std::array<double, 2>, 2> rest;
  for (int step = 0;; ++step) {
    const double c = std::cos(theta_rad);
    const double s = std::sin(theta_rad);
    Dense<3, 3> information{};
    std::array<double, 3> pull{};
    for (int k = 0; k < 2; ++k) {
      const Dense<1, 2> body = {{{body_m[k].x, body_m[k].y}}};
      const auto [arm] = product(body, Dense<2, 2>{{{c, s}, {-s, c}}});
      rest[k] = {spots[k].at_m.x - arm[0] - x_m, spots[k].at_m.y - arm[1] - y_m};
      const Dense<2, 3> slopes = {{{1.0, 0.0, -arm[1]}, {0.0, 1.0, arm[0]}}};
      const Dense<3, 2> turned = product(transposed(slopes), weight[k]);
      const Dense<3, 3> own = product(turned, slopes);
      const std::array<double, 3> force = applied(turned, rest[k]);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          information[i][j] += own[i][j];
        }
        pull[i] += force[i];
      }
    }
    if (step == kSteps) {
      break;
    }
    found.covariance = inverse_of(information);
    const std::array<double, 3> move = applied(found.covariance, pull);
    x_m += move[0];
    y_m += move[1];
    theta_rad += move[2];
  }
  for (int k = 0; k < 2; ++k) {
    const Dense<1, 2> row = {{rest[k]}};
    found.left += product(product(row, weight[k]), transposed(row))[0][0];
  }
  found.x_m = x_m;
  found.y_m = y_m;
  found.theta_rad = theta_rad;
  return found;
}

}  // namespace vision
