// The one place where board time and camera time become host time; what the two ties are made of is told
// in hil/core/clocks.py. Times are arguments: nothing here reads a clock.
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <utility>
#include <vector>

namespace core {

// Ties t_mcu_us (uint32, wraps after 71.6 minutes) to t_host_s by a regression over time exchanges.
class BoardClock {
 public:
  BoardClock(int window, double rtt_limit_s)
      : most_(static_cast<std::size_t>(window)), limit_s_(rtt_limit_s) {}

  bool ready() const { return !window_.empty(); }
  double drift_ratio() const { return rate_ * 1e6 - 1.0; }
  double sigma_s() const { return sigma_at(last_us_); }
  // Host times of request and reply, board time stamped in between; false when it was refused.
  bool exchange(double t_send_s, double t_receive_s, std::int64_t t_mcu_us);
  // A periodic report stamped t_mcu_us reached the host at t_arrival_s.
  void report(std::int64_t t_mcu_us, double t_arrival_s);
  double to_host_s(std::int64_t t_mcu_us);

  std::int64_t exchanges = 0, refused = 0, restarts = 0;
  double rtt_s = std::numeric_limits<double>::quiet_NaN();
  double bound_s = std::numeric_limits<double>::infinity();

 private:
  struct Exchange {
    std::int64_t t_mcu_us;
    double t_mid_s, rtt_s;
    bool clear;  // the answer cannot have waited behind a report
  };

  void forget();
  bool is_clear(std::int64_t unwrapped_us) const;
  std::int64_t unwrap(std::int64_t t_mcu_us) const;
  double sigma_at(std::int64_t unwrapped_us) const;
  bool impossible(std::int64_t unwrapped_us, double mid_s, double rtt_s) const;
  void fit();

  std::size_t most_;
  double limit_s_;
  std::deque<Exchange> window_;
  std::int64_t last_us_ = 0, ref_us_ = 0, mean_us_ = 0;
  double ref_s_ = 0.0, rate_ = 1e-6;
  std::int64_t report_us_ = -1, period_us_ = -1;  // of the newest report; -1: none yet
  std::deque<std::pair<std::int64_t, double>> soonest_;
  std::int64_t soonest_until_us_ = 0;
  double var_s2_ = std::numeric_limits<double>::infinity();
  double var_drift_ = 5e-3 * 5e-3;
};

// Ties the camera's stamps to host time from when the frames arrive.
class CameraClock {
 public:
  CameraClock(double latency_s, int window)
      : latency_s_(latency_s), most_(static_cast<std::size_t>(window)) {}

  bool ready() const { return !gaps_s_.empty(); }
  double sigma_s() const;
  // A frame stamped t_cam_s that reached the host at t_host_s; false when the stamp was refused.
  bool arrival(double t_cam_s, double t_host_s);
  double to_host_s(double t_cam_s) const { return t_cam_s + median_s() - latency_s_; }

  std::int64_t refused = 0, restarts = 0;
  double step_s = 0.0;  // of the stamps, at the last restart

 private:
  double median_s() const;
  double scatter_s() const;
  double margin_s() const;
  bool is_odd(double t_cam_s, double gap_s) const;
  bool has_stepped() const;
  void restart();
  void take(double gap_s);

  double latency_s_;
  std::size_t most_;
  std::deque<double> gaps_s_;
  std::vector<double> sorted_s_, odd_s_;
  double newest_cam_s_ = -std::numeric_limits<double>::infinity();
};

}  // namespace core
