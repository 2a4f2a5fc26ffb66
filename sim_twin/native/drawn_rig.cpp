#include "drawn_rig.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "lanes.hpp"

namespace twin {
namespace {

bool within(const Span& span, double t_s) { return span.first <= t_s && t_s < span.second; }

core::RigFault fault(const std::runtime_error& error) {
  return core::RigFault(std::string("twin: ") + error.what() + "; check the robot's parameters");
}

}  // namespace

void DrawnRig::wait(double until_s) {
  do {
    move(until_s);
  } while (!arrived(until_s));
}

void DrawnRig::move(double until_s) {
  try {
    rig_.advance(until_s);
  } catch (const std::runtime_error& error) {
    throw fault(error);
  }
}

void DrawnRig::move_together(Wait* waits, std::size_t count) {
  std::vector<Leg> legs(count);
  for (std::size_t i = 0; i < count; ++i) {
    Rig& rig = static_cast<DrawnRig*>(waits[i].rig)->rig_;
    legs[i].kernel = &rig.kernel();
    legs[i].t_us = rig.aim(waits[i].until_s);
  }
  advance_together(legs.data(), count);
  for (std::size_t i = 0; i < count; ++i) {
    if (!legs[i].failed) {
      static_cast<DrawnRig*>(waits[i].rig)->rig_.reached(legs[i].reached_us);
      continue;
    }
    try {
      std::rethrow_exception(legs[i].failed);
    } catch (const std::runtime_error& error) {
      waits[i].failed = std::make_exception_ptr(fault(error));
    } catch (...) {
      waits[i].failed = std::current_exception();
    }
  }
}

bool DrawnRig::take_frame(core::PoseFrame& frame) {
  auto taken = rig_.take_frame();
  if (!taken) return false;
  const Exposure exposure = taken->exposure;
  bool repeated = false;
  for (const Span& span : repeats_) repeated = repeated || within(span, exposure.start_s);
  if (!repeated || !last_) {
    last_ = core::PoseFrame{};
    if (poses_ > 0) {
      show(*std::move(taken));
    } else {
      see(*taken);
    }
  }
  last_->index = exposure.index;
  last_->t_cam_s = exposure.t_cam_s;
  frame = *last_;
  double step_s = 0.0;
  for (const auto& [size_s, span] : stamp_steps_) step_s += within(span, exposure.start_s) ? size_s : 0.0;
  if (step_s != 0.0) frame.t_cam_s += step_s;
  return true;
}

// Draws what the localiser says of a frame.
void DrawnRig::see(const Exposed& taken) {
  if (taken.poses.empty()) {
    last_->reason = "hidden from the camera";
  } else if (const auto seen = drawn_.measure(taken.poses.front())) {
    last_->seen = true;
    last_->x_m = seen->x_m;
    last_->y_m = seen->y_m;
    last_->theta_rad = seen->theta_rad;
    last_->quality = claim_.quality;
    last_->sigma_xy_m = claim_.sigma_xy_m;
    last_->sigma_theta_rad = claim_.sigma_theta_rad;
  } else {
    last_->reason = "not seen (drawn)";
  }
}

// Keeps what a picture shows. Its number and poses tell it from others: no two have the same noise.
void DrawnRig::show(Exposed taken) {
  last_->pictured = true;
  last_->picture.assign(reinterpret_cast<const char*>(&taken.exposure.index), sizeof(taken.exposure.index));
  last_->picture.append(reinterpret_cast<const char*>(taken.poses.data()),
                        taken.poses.size() * sizeof(PoseSample));
  shown_ = std::move(taken);
}

core::Truth DrawnRig::truth() const {
  const PoseSample p = rig_.pose_at(rig_.now_s());
  const StateVector& x = rig_.kernel().state();
  return {p.x_m,
          p.y_m,
          p.theta_rad,
          x[kEta1],
          x[kThetaDot],
          p.x_m + claim_.true_d0_m * std::cos(p.theta_rad),
          p.y_m + claim_.true_d0_m * std::sin(p.theta_rad)};
}

}  // namespace twin
