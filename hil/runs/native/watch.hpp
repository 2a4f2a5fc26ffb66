// What a session knows between two ticks, from what has arrived: newest report and frame, delays, and those
// who judge them. Times are host times in s, arguments. World frame, SI.
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "limits.hpp"
#include "link.hpp"
#include "plausibility.hpp"
#include "simulated_rig.hpp"
#include "supervision.hpp"

namespace runs {

// State of the robot at one time, estimated or true; z1 is its flat output point.
struct Motion {
  double x_m, y_m, theta_rad, eta1_m_s, theta_dot_rad_s, z1_x_m, z1_y_m;
};

struct Command {
  double eta1_m_s, theta_dot_rad_s, left_rad_s, right_rad_s;
};

class Watch {
 public:
  Watch(const Safety& safety, const std::array<bool, kReactionCount>& stops, Note note, double uplink_s,
        double rad_per_count)
      : supervisor(safety), plausibility(stops, std::move(note)), uplink_s(uplink_s),
        rad_per_count_(rad_per_count) {}

  // Takes a wheel report.
  void take_report(const wire::WheelReport& new_report) {
    has_report = true;
    report = new_report;
    if (!std::isnan(report.round_trip_s)) uplink_s += kUplinkGain * (0.5 * report.round_trip_s - uplink_s);
  }

  // Takes what the localiser said of a frame exposed at exposure_s. `picture` is what equal pictures have
  // equal; agreement_age_s is the estimator's at the exposure, after it was given the pose and believed it
  // or not.
  void take_frame(const core::PoseFrame& said, double exposure_s, const std::string& reason,
                  const std::string& picture, bool believed, double agreement_age_s) {
    has_frame = true;
    why_not_seen = reason;
    quality = said.quality;
    if (said.seen) {
      ++poses;
      seen = true;
      if (believed) {
        pose_time_s = exposure_s;
        accepted = true;
      }
    }
    const Counts counts{report.wire.left_counts, report.wire.right_counts};
    plausibility.saw(picture, has_report ? &counts : nullptr, rad_per_count_);
    supervisor.saw(said.seen, said.x_m, said.y_m, reason, agreement_age_s);
  }

  // Throws RigFault when the robot has to stop; to be asked while the board is armed.
  void check(double now_s, const Agreement& agreement, std::int64_t pwm_top_counts) {
    try {
      supervisor.check(now_s, has_report ? report.t_arrival_s : -kInfinite, agreement);
    } catch (const Disagreement& fault) {
      throw core::RigFault(plausibility.narrowed(fault.what()));
    }
    if (!has_report) return;
    plausibility.check(
        now_s, {report.wire.omega_left_rad_s, report.wire.omega_right_rad_s},
        {static_cast<double>(report.wire.pwm_left_counts), static_cast<double>(report.wire.pwm_right_counts)},
        pwm_top_counts);
  }

  // 1 (forward) or -1 (backward) for a side at its limit that lacks speed of what it was asked, else 0.
  std::array<int, 2> sides(double most_counts) const {
    if (!has_report || most_counts <= 0.0) return {0, 0};
    const mavlink_wheel_state_t& w = report.wire;
    return {WheelLimits::side(w.pwm_left_counts, asked[0] - w.omega_left_rad_s, most_counts),
            WheelLimits::side(w.pwm_right_counts, asked[1] - w.omega_right_rad_s, most_counts)};
  }

  // Whether a side is driven with what the board would call a stall if its wheel stood.
  bool driven_hard(double stall_counts) const {
    const mavlink_wheel_state_t& w = report.wire;
    return has_report && WheelLimits::driven_hard(w.pwm_left_counts, w.pwm_right_counts, stall_counts);
  }

  // Takes what a tick asked of the wheels, and how it stood with the goal.
  void take_tick(double now_s, double dt_s, const std::array<int, 2>& sides, const Command& command,
                 double theta_dot_rad_s, double error_m) {
    asked = {command.left_rad_s, command.right_rad_s};
    plausibility.asked(asked[0], asked[1]);
    limits.take(sides, command.theta_dot_rad_s, theta_dot_rad_s, dt_s);
    plausibility.check_progress(now_s, error_m);
  }

  // Calls put(value) for each value of a tick's row in the order of hil.record.schema.SAMPLE_NAMES; trace(put)
  // puts the law's. nullptr is not known.
  template <typename Put, typename Trace>
  void row(double now_s, double t_s, const Motion* estimate, const Motion* truth, double goal_x_m,
           double goal_y_m, const Command& command, const wire::Link& link, bool late, Put put, Trace trace) {
    put(t_s);
    motion(estimate, put);
    motion(truth, put);
    put(goal_x_m);
    put(goal_y_m);
    for (const Motion* state : {estimate, truth}) {
      put(state == nullptr ? kNone : state->z1_x_m - goal_x_m);
      put(state == nullptr ? kNone : state->z1_y_m - goal_y_m);
    }
    trace(put);
    put(command.eta1_m_s);
    put(command.theta_dot_rad_s);
    put(command.left_rad_s);
    put(command.right_rad_s);
    const mavlink_wheel_state_t& w = report.wire;
    for (const double value :
         {static_cast<double>(w.omega_left_rad_s), static_cast<double>(w.omega_right_rad_s),
          static_cast<double>(w.pwm_left_counts), static_cast<double>(w.pwm_right_counts),
          static_cast<double>(w.s_left), static_cast<double>(w.s_right)}) {
      put(has_report ? value : kNone);
    }
    put(link.battery_v);
    put(seen ? 1.0 : 0.0);
    put(accepted ? 1.0 : 0.0);
    put(quality);
    put(camera_latency_s);
    put(now_s + uplink_s - pose_time_s);
    put(link.clock.rtt_s);
    put(link.clock.sigma_s());
    put(static_cast<double>(link.reader.counters.lost));
    put(late ? 1.0 : 0.0);
    seen = accepted = false;
  }

  Supervisor supervisor;
  Plausibility plausibility;
  WheelLimits limits;
  bool has_report = false;
  wire::WheelReport report{};
  double uplink_s;  // delay to the board
  Sides asked{0.0, 0.0};
  bool has_frame = false;
  std::string why_not_seen;         // of the newest frame
  double quality = kNone;           // of the newest frame
  double pose_time_s = -kInfinite;  // of the newest pose believed
  double camera_latency_s = kNone;
  std::int64_t poses = 0;
  bool seen = false, accepted = false;  // since the last tick

 private:
  static constexpr double kUplinkGain = 0.05;  // share by which the delay follows a new round trip

  template <typename Put>
  static void motion(const Motion* m, Put put) {
    for (const double Motion::* value :
         {&Motion::x_m, &Motion::y_m, &Motion::theta_rad, &Motion::eta1_m_s, &Motion::theta_dot_rad_s}) {
      put(m == nullptr ? kNone : m->*value);
    }
  }

  double rad_per_count_;
};

}  // namespace runs
