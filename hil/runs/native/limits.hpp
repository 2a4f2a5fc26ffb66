// Which side of the robot stands at the board's limit, and what that cost (hil/runs/watching.py).
#pragma once

#include <array>
#include <cmath>
#include <string>

#include "fault.hpp"

namespace runs {

class WheelLimits {
 public:
  // 1 (forward) or -1 (backward) for a side at its limit that lacks speed, else 0.
  static int side(double pwm_counts, double lacks_rad_s, double most_counts) {
    if (std::fabs(pwm_counts) < kAtLimitRatio * most_counts || pwm_counts * lacks_rad_s <= 0.0) return 0;
    return pwm_counts > 0.0 ? 1 : -1;
  }

  // Whether a side is driven with what the board would call a stall if its wheel stood.
  static bool driven_hard(double left_pwm_counts, double right_pwm_counts, double stall_counts) {
    return stall_counts > 0.0 &&
           std::fmax(std::fabs(left_pwm_counts), std::fabs(right_pwm_counts)) >= stall_counts;
  }

  // One tick: sides at their limit, turn rate asked and made.
  void take(const std::array<int, 2>& sides, double asked_rad_s, double made_rad_s, double dt_s) {
    ran_s_ += dt_s;
    for (int i = 0; i < 2; ++i) side_s_[i] += dt_s * std::abs(sides[i]);
    const double made = asked_rad_s > 0.0 ? made_rad_s : -made_rad_s;
    if ((sides[0] != 0 || sides[1] != 0) && std::fabs(asked_rad_s) >= kAsked_rad_s &&
        made < kMadeRatio * std::fabs(asked_rad_s)) {
      short_s_ += dt_s;
      asked_rad_ += std::fabs(asked_rad_s) * dt_s;
      made_rad_ += made * dt_s;
    }
  }

  // What a reader must know, "" where the motors gave what the turns needed.
  std::string verdict() const {
    if (short_s_ < std::max(kTold_s, kToldRatio * ran_s_)) return "";
    const int worst = side_s_[0] > side_s_[1] ? 0 : 1;
    return core::words(
        "the turn needs more torque than the motors give: %s side at its limit %.0f%% of the run, %.2g of "
        "%.2g rad/s "
        "made for %.1f s; a floor with less grip, stronger motors, a charged battery, or less weight",
        worst == 0 ? "left" : "right", 100.0 * (side_s_[worst] / ran_s_), made_rad_ / short_s_,
        asked_rad_ / short_s_, short_s_);
  }

 private:
  static constexpr double kAtLimitRatio = 0.98;  // of the most duty; the rest is rounding to counts
  // A turn that is wanted and not made: said of a run where it held for so long, and for this share of it.
  static constexpr double kAsked_rad_s = 0.5, kMadeRatio = 0.5, kTold_s = 0.4, kToldRatio = 0.2;

  double ran_s_ = 0.0, short_s_ = 0.0, asked_rad_ = 0.0, made_rad_ = 0.0;
  std::array<double, 2> side_s_{};
};

}  // namespace runs
