// When the host stops the robot by itself (hil/runs/watching.py). Nothing here reads a clock. World frame, SI.
#pragma once

#include <array>
#include <string>

#include "plausibility.hpp"

namespace runs {

// Camera and wheels say different things of the robot's motion.
class Disagreement : public core::RigFault {
 public:
  using core::RigFault::RigFault;
};

struct Safety {  // hil.config.scenario.SafetyConfig
  double fence_x_min_m = 0.0, fence_x_max_m = 0.0, fence_y_min_m = 0.0, fence_y_max_m = 0.0;
  double link_lost_s = 0.0, pose_lost_s = 0.0;
};

// What the estimator says of how it stands with the camera.
struct Agreement {
  double age_s;
  std::array<double, 3> refused;
  std::array<double, 2> scales;
};

// What the board last said of itself; state_name is in words.
struct BoardSays {
  bool armed, disarmed;
};

class Supervisor {
 public:
  explicit Supervisor(const Safety& safety) : safety_(safety) {}

  void check_clock(double now_s);
  void check_host(double now_s);
  // What the localiser said of a frame; agreement_age_s is the estimator's at the exposure, after it was
  // given the pose.
  void saw(bool seen, double x_m, double y_m, const std::string& reason, double agreement_age_s);
  // Throws when the camera no longer answers for the robot, or the link (report_s: arrival of the newest
  // report, -inf before one).
  void check(double now_s, double report_s, const Agreement& agreement) const;
  void check_estimate(double x_m, double y_m) const;

 private:
  bool inside(double x_m, double y_m) const;
  [[noreturn]] void left(const char* how, double x_m, double y_m) const;
  void check_agreement(const Agreement& agreement) const;
  static void check_scales(const Agreement& agreement);

  Safety safety_;
  bool seen_ = false;
  double x_m_ = 0.0, y_m_ = 0.0;
  std::string reason_;
  int outside_ = 0;
  long long refused_ = 0;
  double last_tick_s_ = kNone;
  double newest_s_ = -kInfinite;
};

}  // namespace runs
