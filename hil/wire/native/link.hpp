// The host's end of the link as far as every run needs it all the time: wheel states taken and dated, clocks
// tied, set-points, heartbeats and time exchanges out. What else the board says is handed on.
// hil/wire/link.py is this with the rest. Times are host times in s, arguments.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "clocks.hpp"
#include "exact.hpp"
#include "framing.hpp"

namespace wire {

// One WHEEL_STATE: its board time on the host clock, and the message as it came. round_trip_s is the link's
// alone: from sending the set-point it names to this report's arrival, less the time both lay on the
// board; NaN when the report names no new set-point.
struct WheelReport {
  double t_arrival_s, t_board_s, round_trip_s;
  mavlink_wheel_state_t wire;
};

class Link {
 public:
  Link() : clock(64, 0.5) {}

  // Takes bytes that had arrived by t_s. New wheel reports are appended to `reports`; heard(frame) is called
  // for each good frame before it is looked at, other(frame) for those that this class knows nothing of.
  template <typename Heard, typename Other>
  void take(std::string_view data, double t_s, std::vector<WheelReport>& reports, Heard heard, Other other) {
    reader.feed(data, [&](std::string_view frame) {
      heard(frame);
      switch (message_id(frame)) {
        case MAVLINK_MSG_ID_WHEEL_STATE:
          reports.push_back(
              on_wheel_state(payload_of<mavlink_wheel_state_t>(frame, MAVLINK_MSG_ID_WHEEL_STATE_LEN), t_s));
          break;
        case MAVLINK_MSG_ID_HEARTBEAT: ++heartbeats; break;
        case MAVLINK_MSG_ID_TIMESYNC:
          on_timesync(payload_of<mavlink_timesync_t>(frame, MAVLINK_MSG_ID_TIMESYNC_LEN), t_s);
          break;
        case MAVLINK_MSG_ID_SYS_STATUS:
          sys_status.assign(frame);
          battery_v =
              payload_of<mavlink_sys_status_t>(frame, MAVLINK_MSG_ID_SYS_STATUS_LEN).voltage_battery * 1e-3;
          break;
        default: other(frame);
      }
    });
  }

  // The frame of a set-point (positive drives forward) that goes out at t_s.
  std::string setpoint(double t_s, double left_rad_s, double right_rad_s) {
    ++setpoint_seq_;
    sent_[setpoint_seq_ % sent_.size()] = {setpoint_seq_, t_s};
    return writer.setpoint(static_cast<float>(left_rad_s), static_cast<float>(right_rad_s), setpoint_seq_);
  }

  // Whether a heartbeat or a time exchange is due.
  bool due(double t_s) const { return t_s >= timer_due_s_; }
  // Calls write(frame) for each of the frames that are.
  template <typename Write>
  void run_timers(double t_s, Write write) {
    if (t_s >= heartbeat_due_s_) {
      heartbeat_due_s_ = t_s + kHeartbeatPeriod_s;
      write(writer.heartbeat());
    }
    if (t_s >= timesync_due_s_) {
      timesync_due_s_ = t_s + (clock.exchanges < kTimesyncFirst ? kTimesyncFirstPeriod_s : kTimesyncPeriod_s);
      write(ask_time(t_s));
    }
    timer_due_s_ = std::min(heartbeat_due_s_, timesync_due_s_);
  }
  // What a procedure (hil/wire/handshake.py) waits for: until_s, or something that it may look at.
  void rest_until(double until_s) { resting_ = {until_s, heartbeats, reader.counters.signed_frames}; }
  // Whether that has come. Messages that this class knows nothing of, the caller sees itself.
  bool rested(double t_s) const {
    return t_s >= resting_.until_s || heartbeats != resting_.heartbeats ||
           reader.counters.signed_frames != resting_.signed_frames;
  }
  // The frame that asks for the board's time; the answer is one more exchange of `clock`.
  std::string ask_time(double t_s) {
    const std::int64_t ts1_ns = core::rounded(t_s * 1e9);
    if (asked_.size() > kAskedMost) asked_.pop_front();  // replies that never came
    asked_.emplace_back(ts1_ns, t_s);
    return writer.timesync(ts1_ns);
  }

  FrameReader reader;
  FrameWriter writer{kHostSystem, kHostComponent};
  core::BoardClock clock;
  int state = HIL_STATE_DISARMED, reason = HIL_REASON_NONE;
  std::int64_t heartbeats = 0, frames_sent = 0;
  std::string sys_status;  // the newest one's frame
  double battery_v = std::numeric_limits<double>::quiet_NaN();

 private:
  static constexpr double kHeartbeatPeriod_s = 1.0, kTimesyncPeriod_s = 0.5;
  // The tie gains most from its first exchanges.
  static constexpr std::int64_t kTimesyncFirst = 16;
  static constexpr double kTimesyncFirstPeriod_s = 0.1;
  static constexpr std::size_t kAskedMost = 31;
  static constexpr double kNever_s = -std::numeric_limits<double>::infinity();

  struct Resting {
    double until_s = kNever_s;
    std::int64_t heartbeats = 0, signed_frames = 0;
  };
  struct Sent {
    std::uint16_t seq = 0;
    double t_s = std::numeric_limits<double>::quiet_NaN();
  };

  WheelReport on_wheel_state(const mavlink_wheel_state_t& m, double t_s) {
    state = m.state;
    reason = m.reason;
    double round_trip_s = std::numeric_limits<double>::quiet_NaN();
    if (m.setpoint_seq != echoed_seq_) {
      echoed_seq_ = m.setpoint_seq;
      const Sent& sent = sent_[m.setpoint_seq % sent_.size()];
      if (sent.seq == m.setpoint_seq && !std::isnan(sent.t_s)) {
        const std::uint32_t rest_us = m.t_mcu_us - m.t_setpoint_us;
        round_trip_s = t_s - sent.t_s - rest_us * 1e-6;
      }
    }
    clock.report(m.t_mcu_us, t_s);
    return {t_s, clock.ready() ? clock.to_host_s(m.t_mcu_us) : t_s, round_trip_s, m};
  }

  void on_timesync(const mavlink_timesync_t& m, double t_s) {
    for (auto asked = asked_.begin(); asked != asked_.end(); ++asked) {
      if (asked->first != m.ts1) continue;
      const double sent_s = asked->second;
      asked_.erase(asked);
      if (m.tc1 != 0) clock.exchange(sent_s, t_s, m.tc1 / 1000 - (m.tc1 % 1000 < 0 ? 1 : 0));
      return;
    }
  }

  std::uint16_t setpoint_seq_ = 0, echoed_seq_ = 0;
  std::array<Sent, 128> sent_{};
  double timer_due_s_ = kNever_s, heartbeat_due_s_ = kNever_s, timesync_due_s_ = kNever_s;
  std::deque<std::pair<std::int64_t, double>> asked_;
  Resting resting_;
};

}  // namespace wire
