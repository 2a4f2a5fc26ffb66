// Steps of a kernel that are worked out elsewhere (lanes.hpp): how many may be, and what is made of them.
#include <algorithm>
#include <cmath>

#include "kernel.hpp"

namespace twin {
namespace {

// An edge's time is reckoned from the step's begin, to 5e-16 of its length. From this many steps on it cannot
// round past the step's end, where the board would drop it: then only how many there were matters.
constexpr std::int64_t kEarly_steps = 16;

}  // namespace

// Steps up to and with the one at whose end t_us is reached.
std::int64_t Kernel::steps_to(std::int64_t t_us) const {
  return (t_us - time_us_ + options_.step_us - 1) / options_.step_us;
}

// Steps that lie between the times at which faults and loads come or go, or less by two for the rounding of times.
std::int64_t Kernel::steady_steps() const {
  constexpr std::int64_t kMany = std::int64_t{1} << 40;
  if ((faults_.empty() && disturbances_.empty()) || begin_us_ >= kNever_us) return kMany;
  const double since_s = 1e-6 * static_cast<double>(std::max<std::int64_t>(time_us_ - begin_us_, 0));
  const double begin_s = 1e-6 * static_cast<double>(std::max<std::int64_t>(begin_us_ - time_us_, 0));
  const double until_s = std::min(faults_.steady_until_s(since_s), disturbances_.steady_until_s(since_s));
  const double steady_s = until_s - since_s + begin_s;
  const double steps = std::floor(1e6 * steady_s / static_cast<double>(options_.step_us)) - 2.0;
  return static_cast<std::int64_t>(std::clamp(steps, 0.0, static_cast<double>(kMany)));
}

// Whether the board learns of edges nothing but their number: no wire is at fault, nor has one left a mark.
bool Kernel::edges_are_counts() const {
  if (fault_.encoders_exchanged) return false;
  for (const FaultState::Side& side : fault_.side) {
    if (side.dead_a || side.dead_b || side.swapped || side.glitch || side.grip != 1.0) return false;
  }
  const std::uint8_t pins[2] = {encoders_[0].pins(), encoders_[1].pins()};
  return encoders_[0].in_order() && encoders_[1].in_order() && board_->takes_turns(pins);
}

std::int64_t Kernel::even_steps(std::int64_t t_us) {
  if (outside_ || !plant_.rolls() || time_us_ < kEarly_steps * options_.step_us) return 0;
  std::int64_t until_us = std::min(t_us, board_->quiet_until_us());
  if (!disturbances_.empty() && time_us_ < begin_us_) until_us = std::min(until_us, begin_us_);
  const std::int64_t steps = std::min(steps_to(until_us), steady_steps());
  if (steps < 1) return 0;
  set_faults();
  set_drive();
  if (!edges_are_counts()) return 0;
  const bool jammed = drive_.jam[0] != 0.0 || drive_.jam[1] != 0.0;
  acted_on_ =
      jammed || (disturbed() && disturbances_.at_work(1e-6 * static_cast<double>(time_us_ - begin_us_)));
  if (disturbed() || jammed) return steps;
  // A robot that stands is left to `coast`, of which one whole step has to be seen first.
  const StateVector& x = plant_.state();
  const bool stands = drive_.duty[0] == 0.0 && drive_.duty[1] == 0.0 && x[kOmegaL] == 0.0 &&
                      x[kOmegaR] == 0.0 && x[kCurrentL] == 0.0 && x[kCurrentR] == 0.0;
  return stands ? 0 : steps;
}

// Of all steps but the last the board learns the encoders' counts alone; the last one it meets as any other.
void Kernel::follow(const Track& track, const StateVector& end, double sag_v) {
  const std::int64_t last = track.steps - 1;
  double wheel_rad[2] = {plant_.state()[kWheelL], plant_.state()[kWheelR]};
  if (last > 0) {
    std::int64_t counts[2];
    for (int side = 0; side < 2; ++side) {
      wheel_rad[side] = track.at(last - 1, Track::kWheelLeftOf + side);
      counts[side] = encoders_[side].turn(wheel_rad[side] + slipped_rad_[side]);
    }
    const std::uint8_t pins[2] = {encoders_[0].pins(), encoders_[1].pins()};
    board_->turned(counts, pins);
    const std::int64_t until_us = time_us_ + last * options_.step_us;
    std::int64_t at_us = (time_us_ / kPoseSpacing_us + 1) * kPoseSpacing_us;
    for (; at_us <= until_us; at_us += kPoseSpacing_us) {
      const std::int64_t step = (at_us - time_us_) / options_.step_us - 1;
      remember({track.at(step, Track::kXOf), track.at(step, Track::kYOf), track.at(step, Track::kThetaOf)});
    }
    time_us_ = until_us;
  }
  sag_v_ = sag_v;
  plant_.changed_state() = end;
  end_step(wheel_rad);
}

}  // namespace twin
