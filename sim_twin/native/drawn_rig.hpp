// The simulated rig as the host's native code meets it: its frames bring drawn poses, or pictures that are drawn
// where somebody looks (sim_twin/camera_sim.py).
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
  // A picture takes `poses` poses of its exposure along; with 0 of them frames bring drawn poses.
  DrawnRig(Rig& rig, DrawnPoses& drawn, const Claim& claim, core::LineBacklog& backlog, int poses)
      : rig_(rig), drawn_(drawn), claim_(claim), backlog_(backlog), poses_(poses) {}

  // Host times between which frames repeat the one before, and by how much their stamps are off in others.
  void set_faults(std::vector<Span> repeats, std::vector<std::pair<double, Span>> stamp_steps) {
    repeats_ = std::move(repeats);
    stamp_steps_ = std::move(stamp_steps);
  }

  double now_s() const override { return rig_.now_s(); }
  void wait(double until_s) override;
  void move(double until_s) override;
  bool arrived(double until_s) override { return rig_.arrive(until_s, poses_ > 0 ? poses_ : 1); }
  void move_together(Wait* waits, std::size_t count) override;
  std::string read() override { return rig_.read(); }
  void write(const std::string& data) override {
    backlog_.write(rig_.now_s(), static_cast<std::int64_t>(data.size()), "twin: ");
    rig_.send(data);
  }
  bool take_frame(core::PoseFrame& frame) override;
  core::Truth truth() const override;
  // What the picture of the frame taken last shows: of one that repeats the frame before, that one's.
  const std::optional<Exposed>& shown() const { return shown_; }

 private:
  void see(const Exposed& taken);
  void show(Exposed taken);

  Rig& rig_;
  DrawnPoses& drawn_;
  Claim claim_;
  core::LineBacklog& backlog_;
  int poses_;
  std::vector<Span> repeats_;
  std::vector<std::pair<double, Span>> stamp_steps_;
  std::optional<core::PoseFrame> last_;
  std::optional<Exposed> shown_;
};

}  // namespace twin
