// Serial line and radio between host and board: pace, delay, loss, corruption, cuts. Times are s of one
// clock, passed in. What the model is: sim_twin/link_model.py, docs/twin.md.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "chance.hpp"

namespace twin {

using Span = std::pair<double, double>;  // start, end, s
using Arrival = std::pair<double, std::string>;

constexpr double kNever_s = -std::numeric_limits<double>::infinity();

// A UART that sends one byte after the other.
class Serialiser {
 public:
  explicit Serialiser(double byte_s) : byte_s_(byte_s) {}
  // The time at which the last of `size` bytes given at t_s has left.
  double send(double t_s, std::size_t size);

 private:
  double byte_s_;
  double free_s_ = kNever_s;
};

struct ChannelOptions {
  double latency_s = 0.0, jitter_s = 0.0;
  double to_good = 0.0, to_bad = 0.0;  // chances of Gilbert's chain, a chunk
  double corruption_ratio = 0.0;
};

// One direction of the link behind the serial port; chunks arrive in the order they left.
class Channel {
 public:
  Channel(const ChannelOptions& options, const Chance& chance);
  // Arrival time and bytes of a chunk that left at t_s; nothing when it is lost.
  std::optional<Arrival> carry(double t_s, std::string data);
  std::vector<Span> cuts;     // between which nothing passes, chunks on their way included
  std::vector<Span> doubles;  // between which every chunk arrives twice
  std::vector<Span> swaps;    // between which one waits for the next one, and arrives behind it

 private:
  bool is_lost();
  std::int64_t clean_bytes();
  void corrupt(std::string& data);

  ChannelOptions options_;
  Chance chance_;
  double last_s_ = kNever_s;
  std::string waiting_;
  bool bad_ = false;
  std::int64_t clean_ = 0;
};

}  // namespace twin
