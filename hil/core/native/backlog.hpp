// How many bytes a serial line still has to carry, from what was written and when.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "fault.hpp"

namespace core {

class LineBacklog {
 public:
  // What a port and its driver hold of bytes that the line has not carried yet.
  static constexpr std::int64_t kPortBytes = 4096;

  explicit LineBacklog(int baud) : bytes_1_s_(baud / 10.0) {}  // start, eight data, stop

  double waiting_bytes(double t_s) const { return std::max(free_s_ - t_s, 0.0) * bytes_1_s_; }

  // Takes note of `size` bytes; throws RigFault, after `whose`, when the port would have to hold too many.
  void write(double t_s, std::int64_t size, const char* whose = "") {
    const double waiting = waiting_bytes(t_s);
    if (waiting + static_cast<double>(size) > static_cast<double>(kPortBytes)) {
      throw RigFault(
          words("%sport is full: %.0f bytes wait for a line of %.0f byte/s, it holds %d; send less often, "
                "or take a faster line",
                whose, waiting, bytes_1_s_, static_cast<int>(kPortBytes)));
    }
    free_s_ = std::max(t_s, free_s_) + static_cast<double>(size) / bytes_1_s_;
  }
  void clear() { free_s_ = -std::numeric_limits<double>::infinity(); }

 private:
  double bytes_1_s_;
  double free_s_ = -std::numeric_limits<double>::infinity();
};

}  // namespace core
