// Residuals between commands, wheels, PWM and camera (hil/runs/watching.py says what each is for).
// Nothing here reads a clock. SI units and radians; sides are 0 left, 1 right.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <string>

#include "fault.hpp"

namespace runs {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

using Sides = std::array<double, 2>;
using Counts = std::array<std::int32_t, 2>;
// Called with the kind and the text of an event.
using Note = std::function<void(const char*, const std::string&)>;

// What may be wrong, in the order of kReactions.
enum Reaction : int {
  kFramesRepeated,
  kNoProgress,
  kMotorStuck,
  kEncoderIntermittent,
  kSidesSwapped,
  kReactionCount
};
constexpr const char* kReactions[kReactionCount] = {"frames_repeated", "no_progress", "motor_stuck",
                                                    "encoder_intermittent", "sides_swapped"};
constexpr const char kDiagnosis[] = "diagnosis";  // kind of the record's events that the verdict repeats

// For how long a condition has held without a break.
struct Held {
  double since_s = kInfinite;
  double after(double now_s, bool holds) {
    if (!holds) {
      since_s = kInfinite;
      return 0.0;
    }
    since_s = now_s < since_s ? now_s : since_s;
    return now_s - since_s;
  }
};

// Judges each tick; throws RigFault for a fault whose reaction is to stop, notes the others once.
class Plausibility {
 public:
  Plausibility(const std::array<bool, kReactionCount>& stops, Note note)
      : stops_(stops), note_(std::move(note)) {}

  // Takes one frame. `picture` is what equal pictures have equal, "" where there is nothing to compare;
  // `counts` are those of the newest report, nullptr before one. The same picture again while the wheels
  // turn is a fault.
  void saw(const std::string& picture, const Counts* counts, double rad_per_count);
  // What is wrong where camera and wheels disagree: frames that repeat, if they do.
  std::string narrowed(const std::string& fault) const;
  // Judges the wheels against what was asked of them up to now.
  void check(double now_s, const Sides& given_rad_s, const Sides& pwm_counts, std::int64_t pwm_top_counts);
  // What is asked of the wheels from now on.
  void asked(double left_rad_s, double right_rad_s) { asked_ = {left_rad_s, right_rad_s}; }
  // Whether the robot still gets nearer to its goal, or stays near enough.
  void check_progress(double now_s, double error_m);
  // Tells what was seen over the whole run and stops nothing.
  void finish();

 private:
  struct Side {  // what is known of one
    Held stuck, full, dip;
    double stuck_asked_rad = 0.0, stuck_given_rad = 0.0;
    bool turned = false;
    std::deque<double> dips_s;
    double asked_rad_s = 0.0, asked_rad = 0.0, given_rad = 0.0, weak_s = 0.0;
  };

  void check_side(double now_s, double dt_s, int index, double given, double pwm_ratio);
  void check_dips(double now_s, int index, double given);
  void check_swapped(double now_s, const Sides& given);
  std::string repeated() const;
  void react(Reaction what, const std::string& evidence);

  std::array<bool, kReactionCount> stops_;
  Note note_;
  std::array<bool, kReactionCount> told_{};
  std::array<Side, 2> sides_;
  Held swapped_;
  Sides asked_{0.0, 0.0};
  double last_s_ = kNone;
  std::string picture_;
  std::int64_t repeats_ = 0;
  bool has_counts_ = false;
  Counts counts_{};          // when the picture last changed
  double turned_rad_ = 0.0;  // since then
  double least_m_ = kInfinite, least_s_ = kNone;
};

}  // namespace runs
