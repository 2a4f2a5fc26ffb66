// The simulated rig with drawn poses for a camera, as the host's native code meets it.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "backlog.hpp"
#include "eye.hpp"
#include "simulated_rig.hpp"
#include "rig.hpp"

namespace twin {

// What the localiser claims of a pose that it gives; where the robot's flat output lies.
struct Claim {
  double quality = 0.0, sigma_xy_m = 0.0, sigma_theta_rad = 0.0, true_d0_m = 0.0;
};

class DrawnRig final : public core::SimulatedRig {
 public:
  DrawnRig(Rig& rig, DrawnPoses& drawn, const Claim& claim, core::LineBacklog& backlog)
      : rig_(rig), drawn_(drawn), claim_(claim), backlog_(backlog) {}

  // Host times between which frames repeat the one before, and by how much their stamps are off in others.
  void set_faults(std::vector<Span> repeats, std::vector<std::pair<double, Span>> stamp_steps) {
    repeats_ = std::move(repeats);
    stamp_steps_ = std::move(stamp_steps);
  }

  double now_s() const override { return rig_.now_s(); }
  void wait(double until_s) override;
  void move(double until_s) override;
  bool arrived(double until_s) override { return rig_.arrive(until_s, 1); }
  void move_together(Wait* waits, std::size_t count) override;
  std::string read() override { return rig_.read(); }
  void write(const std::string& data) override {
    backlog_.write(rig_.now_s(), static_cast<std::int64_t>(data.size()), "twin: ");
    rig_.send(data);
  }
  bool take_frame(core::PoseFrame& frame) override;
  core::Truth truth() const override;

 private:
  Rig& rig_;
  DrawnPoses& drawn_;
  Claim claim_;
  core::LineBacklog& backlog_;
  std::vector<Span> repeats_;
  std::vector<std::pair<double, Span>> stamp_steps_;
  std::optional<core::PoseFrame> last_;
};

}  // namespace twin
