#include "pump.hpp"

#include <algorithm>
#include <cstring>

#include "exact.hpp"

namespace runs {

std::string odd_stamp(double ahead_s) {
  if (ahead_s > 0.0) return core::words("stamped %.3f s later than it came", ahead_s);
  return "stamped earlier than a frame before it, or not at all";
}

Pump::Stop Pump::begin(double until_s, bool busy, bool apart) {
  until_s_ = until_s;
  last_s_ = -kInfinite;
  waited_ = false;
  stage_ = kLook;
  return run(busy, apart);
}

Pump::Stop Pump::begin_periods(double period_s, double last_s) {
  period_s_ = period_s;
  last_s_ = last_s;
  stage_ = kLook;
  return next_period() ? run(true, false) : kReached;
}

bool Pump::next_period() {
  const double now_s = rig_.now_s();
  if (now_s >= last_s_) return false;
  until_s_ = std::min(last_s_, now_s + period_s_);
  waited_ = false;
  return true;
}

Pump::Stop Pump::go_on(bool busy, bool apart) { return run(busy, apart); }

Pump::Stop Pump::run(bool busy, bool apart) {
  while (true) {
    if (stage_ == kLook) {
      now_s_ = rig_.now_s();
      watch_.supervisor.check_clock(now_s_);
      others.clear();
      reports_.clear();
      stage_ = kTake;
      take_bytes();
      if ((busy && link_.rested(now_s_)) || !others.empty()) return kHeard;
    }
    if (stage_ == kTake) {
      stage_ = kWait;
      for (const wire::WheelReport& report : reports_) {
        watch_.take_report(report);
        fused_.take_wheels(report.t_board_s, report.wire.left_counts, report.wire.right_counts);
      }
      core::PoseFrame frame;
      while (rig_.take_frame(frame)) take_frame(frame);
      if (!others.empty()) return kTaken;
    }
    const bool over = now_s_ >= until_s_;
    if (stage_ == kWait && !(over && waited_)) {
      stage_ = over ? kOver : kLook;
      waited_ = true;
      away_until_s_ = over ? now_s_ : until_s_;
      if (apart) return kAway;
      rig_.wait(away_until_s_);
    }
    if (stage_ == kLook) continue;
    stage_ = kLook;
    if (!busy || !next_period()) return kReached;
  }
}

void Pump::take_bytes() {
  const std::string data = rig_.read();
  if (!data.empty()) {
    link_.take(
        data, now_s_, reports_, [](std::string_view) {},
        [this](std::string_view frame) { others.emplace_back(wire::message_id(frame), std::string(frame)); });
  }
  if (link_.due(now_s_)) link_.run_timers(now_s_, [this](const std::string& frame) { write(frame); });
}

void Pump::write(const std::string& frame) {
  rig_.write(frame);
  ++link_.frames_sent;
}

// Hands the pose of a frame to the estimator at its exposure time. A frame whose stamp the camera's clock
// refuses is recorded and not looked at.
void Pump::take_frame(const core::PoseFrame& frame) {
  const bool stamped = camera_.arrival(frame.t_cam_s, now_s_);
  double exposure_s = camera_.to_host_s(frame.t_cam_s);
  if (camera_.restarts != restarts_) {
    restarts_ = camera_.restarts;
    note_("camera", core::words("its clock has stepped by %+.3f s; tied anew", camera_.step_s));
  }
  Seen seen;
  if (!stamped) {
    seen.reason = odd_stamp(exposure_s - now_s_);
  } else {
    exposure_s = std::min(exposure_s, now_s_);  // jitter aside, no frame is exposed after it came
    if (frame.pictured) {
      seen = eye_(fused_.state_at(exposure_s));
    } else {
      seen.said = frame;
      seen.reason = frame.reason;
    }
    watch_.camera_latency_s = now_s_ - exposure_s;
  }
  const core::PoseFrame& said = seen.said;
  bool believed = false;
  if (said.seen) {
    fused_.expect(seen.excess);
    believed = fused_.take_pose(exposure_s, {said.x_m, said.y_m, said.theta_rad}, said.sigma_xy_m,
                                said.sigma_theta_rad);
  }
  std::string picture = frame.picture;
  if (frame.seen) {  // the pose of the frame itself: whether its stamp is believed does not matter
    const double pose[3] = {frame.x_m + 0.0, frame.y_m + 0.0, frame.theta_rad + 0.0};
    picture.assign(reinterpret_cast<const char*>(pose), sizeof(pose));
  }
  watch_.take_frame(said, exposure_s, seen.reason, picture, believed, fused_.agreement_age_s(exposure_s));
  frames.push_back({now_s_, now_s_ - exposure_s, frame.t_cam_s, frame.index, said.seen, said.x_m, said.y_m,
                    said.theta_rad, said.quality, said.sigma_xy_m, said.sigma_theta_rad, seen.covariance,
                    seen.marks});
}

Agreement Pump::agreement(double now_s) const {
  const estimator::Vector& x = fused_.filter().mean();
  const estimator::Innovation& off = fused_.refused();
  return {fused_.agreement_age_s(now_s),
          {off[0], off[1], off[2]},
          {x[estimator::kDistance], x[estimator::kTurn]}};
}

const estimator::State& Pump::look(double now_s, double most_counts) {
  looked_ = fused_.state_at(now_s + watch_.uplink_s);
  if (!looked_) throw core::RigFault("camera: no pose to estimate from");
  watch_.supervisor.check_estimate(looked_->pose.x_m, looked_->pose.y_m);
  sides_ = watch_.sides(most_counts);
  return *looked_;
}

void Pump::act(double now_s, double dt_s, const Command& command, double goal_x_m, double goal_y_m) {
  send_setpoint(rig_.now_s(), command.left_rad_s, command.right_rad_s);
  fused_.take_command(now_s + watch_.uplink_s, {command.left_rad_s, command.right_rad_s});
  const double error_m = core::hypot(goal_x_m - looked_->z1_m[0], goal_y_m - looked_->z1_m[1]);
  watch_.take_tick(now_s, dt_s, sides_, command, looked_->theta_dot_rad_s, error_m);
}

std::optional<Motion> Pump::estimate(double t_s) const {
  const auto state = fused_.state_at(t_s);
  if (!state) return std::nullopt;
  return Motion{state->pose.x_m,        state->pose.y_m, state->pose.theta_rad, state->eta1_m_s,
                state->theta_dot_rad_s, state->z1_m[0],  state->z1_m[1]};
}

Motion Pump::truth() const {
  const core::Truth t = rig_.truth();
  return {t.x_m, t.y_m, t.theta_rad, t.eta1_m_s, t.theta_dot_rad_s, t.z1_x_m, t.z1_y_m};
}

}  // namespace runs
