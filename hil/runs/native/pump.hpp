// Bytes and frames of a simulated rig taken as they arrive, from arrival to arrival, without a step back into
// Python: for the default estimator, and frames that bring their poses or are looked at by an eye. hil/runs/session.py does the same for
// any rig and any estimator; what both do with what has come is Watch, Link, the clocks and the estimator.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clocks.hpp"
#include "fused.hpp"
#include "watch.hpp"

namespace runs {

// Why a frame is not looked at whose exposure would lie ahead_s after its arrival.
std::string odd_stamp(double ahead_s);

// What was seen in one frame: `marks` are where, in px, as a record's last columns have them after `covariance`.
struct Seen {
  core::PoseFrame said;
  std::string reason;
  estimator::Excess excess{};
  std::array<double, 6> covariance = none<6>();
  std::array<double, 4> marks = none<4>();

  template <std::size_t N>
  static std::array<double, N> none() {
    std::array<double, N> out;
    out.fill(kNone);
    return out;
  }
};

// Finds the robot in the picture of the frame taken last; it is expected as it was at the exposure, if that is known.
using Eye = std::function<Seen(const std::optional<estimator::State>& expected)>;

class Pump {
 public:
  enum Stop { kReached, kHeard, kTaken, kAway };

  Pump(core::SimulatedRig& rig, wire::Link& link, core::CameraClock& camera, estimator::Fused& fused,
       Watch& watch, Note note, Eye eye)
      : rig_(rig), link_(link), camera_(camera), fused_(fused), watch_(watch), note_(std::move(note)),
        eye_(std::move(eye)) {}

  // Takes what arrives until until_s, and waits once at least. Stops on the way where messages wait in
  // `others`, or after the bytes of an arrival that the procedure under way (`busy`) may look at, or whose
  // time-out has come: kHeard before, kTaken after reports and frames were taken. `apart`: kAway instead of a
  // wait, for who moves the rig on until away_until_s.
  Stop begin(double until_s, bool busy, bool apart = false);
  // The same period after period until last_s, for as long as the procedure under way is not done.
  Stop begin_periods(double period_s, double last_s);
  Stop go_on(bool busy, bool apart = false);
  core::SimulatedRig& rig() { return rig_; }
  double away_until_s() const { return away_until_s_; }

  double now_s() const { return now_s_; }
  const wire::Link& link() const { return link_; }
  Agreement agreement(double now_s) const;
  std::optional<Motion> estimate(double t_s) const;
  Motion truth() const;
  void send_setpoint(double t_s, double left_rad_s, double right_rad_s) {
    write(link_.setpoint(t_s, left_rad_s, right_rad_s));
  }
  double rig_now_s() const { return rig_.now_s(); }
  // The state at the actuation time of a tick at now_s, inside the fence; else RigFault. With it: which side
  // stands at its limit of most_counts.
  const estimator::State& look(double now_s, double most_counts);
  const std::array<int, 2>& sides() const { return sides_; }
  // Sends what a tick asks of the wheels, and tells estimator and judges of it; goal is that of the look.
  void act(double now_s, double dt_s, const Command& command, double goal_x_m, double goal_y_m);
  // Sends a frame to the board.
  void write(const std::string& frame);

  std::vector<std::pair<std::uint32_t, std::string>> others;  // messages that Python handles
  struct FrameRow {
    double t_arrival_s, latency_s, t_cam_s;
    std::int64_t index;
    bool seen;
    double x_m, y_m, theta_rad, quality, sigma_xy_m, sigma_theta_rad;
    std::array<double, 6> covariance;
    std::array<double, 4> marks;
  };
  std::vector<FrameRow> frames;

 private:
  enum Stage { kLook, kTake, kWait, kOver };

  Stop run(bool busy, bool apart);
  bool next_period();
  void take_bytes();
  void take_frame(const core::PoseFrame& frame);

  core::SimulatedRig& rig_;
  wire::Link& link_;
  core::CameraClock& camera_;
  estimator::Fused& fused_;
  Watch& watch_;
  Note note_;
  Eye eye_;
  Stage stage_ = kLook;
  double until_s_ = 0.0, now_s_ = 0.0, away_until_s_ = 0.0;
  double period_s_ = 0.0, last_s_ = -kInfinite;  // of begin_periods
  bool waited_ = false;
  std::int64_t restarts_ = 0;
  std::vector<wire::WheelReport> reports_;
  std::optional<estimator::State> looked_;
  std::array<int, 2> sides_{};
};

}  // namespace runs
