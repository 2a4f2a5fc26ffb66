// Everything between two looks of the host at its rig: kernel, line, radio and camera move on to the
// next arrival of bytes or of a frame. Host time is the kernel's + start_s.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "eye.hpp"
#include "kernel.hpp"
#include "link.hpp"

namespace twin {

struct RigOptions {
  double start_s = 0.0;
  int baud = 57600;
  double readout_s = 0.0;  // of a rolling shutter: from the first row to the last
};

// A frame that has arrived: the robot's poses over its exposure, none while it is hidden.
struct Exposed {
  Exposure exposure;
  std::vector<PoseSample> poses;
};

class Rig {
 public:
  Rig(Kernel& kernel, const RigOptions& options, const Channel& down, const Channel& up,
      const Shutter& shutter);

  // Host times between which the camera stalls (by start) and the robot is hidden. To be called before
  // the first wait.
  void set_spans(std::vector<Span> stalls, std::vector<Span> hidden);
  // Both ways of the link, for the host times of its faults.
  Channel& down() { return down_; }
  Channel& up() { return up_; }

  double now_s() const { return now_s_; }
  // Moves to until_s, or to the next arrival before it. A frame takes `poses` poses along.
  void wait(double until_s, int poses);
  // The same in halves: `advance` runs towards the next arrival, `arrive` tells whether it was one.
  void advance(double until_s);
  bool arrive(double until_s, int poses);
  // `advance` in parts, for kernels that move side by side (lanes.hpp): the kernel's time to be reached, and
  // what was reached.
  std::int64_t aim(double until_s);
  void reached(std::int64_t t_us) { reached_ = t_us >= target_us_; }

  std::string read();  // what has arrived from the board
  void send(const std::string& data);
  void discard_unsent();
  std::optional<Exposed> take_frame();
  PoseSample pose_at(double t_s) const;
  const Kernel& kernel() const { return kernel_; }
  Kernel& kernel() { return kernel_; }

 private:
  struct Unsent {
    double begins_s, left_s;
    std::string data;
  };

  std::int64_t kernel_us(double t_s) const;
  void carry(double until_s);
  bool take_arrivals(int poses);
  std::vector<PoseSample> poses_over(const Exposure& exposure, int poses) const;

  Kernel& kernel_;
  RigOptions options_;
  Channel down_, up_;
  Serialiser port_;
  Shutter shutter_;
  std::vector<Span> stalls_, hidden_;
  std::optional<Exposure> next_frame_;
  double now_s_;
  double target_s_ = 0.0;
  std::int64_t target_us_ = 0;
  bool reached_ = false, begun_ = false;
  std::deque<Unsent> unsent_;
  std::deque<Arrival> uplink_;
  std::deque<Exposed> exposed_;
  std::string arrived_;
};

}  // namespace twin
