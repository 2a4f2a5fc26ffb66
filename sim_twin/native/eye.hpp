// The camera without its picture: when it exposes, when a frame arrives, and what a localiser would say.
// What the models are: sim_twin/camera_timing.py and sim_twin/drawn_poses.py.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "chance.hpp"
#include "kernel.hpp"
#include "link.hpp"

namespace twin {

// One frame on its way: host times in s, t_cam_s the middle on the camera's clock.
struct Exposure {
  std::int64_t index = 0;
  double start_s = 0.0, end_s = 0.0, t_cam_s = 0.0, arrival_s = 0.0;
};

struct ShutterOptions {
  double period_s = 0.0, exposure_s = 0.0, latency_s = 0.0, jitter_s = 0.0, drop_ratio = 0.0;
  double t_first_s = 0.0, clock_start_s = 0.0, clock_rate = 1.0, most_sigmas = 3.0;
};

class Shutter {
 public:
  Shutter(const ShutterOptions& options, const Chance& chance) : options_(options), chance_(chance) {}
  // The next frame that will arrive; nothing when the camera has stalled for good. `stalls` by start.
  std::optional<Exposure> next(const std::vector<Span>& stalls);

 private:
  void skip(const std::vector<Span>& stalls);
  Exposure expose();

  ShutterOptions options_;
  Chance chance_;
  std::int64_t index_ = 0;
  double last_arrival_s_ = kNever_s;
};

// One wave over floor and heading: sin(per_x X + per_y Y + turns theta + phase).
struct Wave {
  double per_x = 0.0, per_y = 0.0, turns = 0.0, phase = 0.0;
};

struct DrawnOptions {
  double not_seen_ratio = 0.0, outlier_ratio = 0.0, place_ratio = 0.0;
  double sigma_xy_m = 0.0, sigma_theta_rad = 0.0, outlier_xy_m = 0.0, outlier_theta_rad = 0.0;
  bool swapped = false;
  double shift_m = 0.0;
};

class DrawnPoses {
 public:
  DrawnPoses(const DrawnOptions& options, const Chance& chance);
  // What is seen of a robot in view; nothing where the localiser misses it.
  std::optional<PoseSample> measure(const PoseSample& pose);

 private:
  // A bias that stands with the place: waves over the floor and the heading, so short that places a few
  // pixels apart have each their own, so long that a robot at rest keeps its. Together they are a number of
  // mean 0 and deviation 1 over all poses, the same whenever the robot is there.
  static constexpr std::size_t kWaves = 12;
  static constexpr double kShortest_m = 0.01, kLongest_m = 0.05;
  static constexpr int kMostPerTurn = 12;
  using Waves = std::array<Wave, kWaves>;

  Wave wave();
  static double bias(const Waves& waves, const PoseSample& pose);

  DrawnOptions options_;
  std::array<Waves, 3> places_;  // of X, Y and theta
  Chance chance_;
};

}  // namespace twin
