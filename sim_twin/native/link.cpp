#include "link.hpp"

#include <algorithm>
#include <cmath>

namespace twin {
namespace {

bool within(const std::vector<Span>& spans, double t_s) {
  for (const auto& [start_s, end_s] : spans) {
    if (start_s <= t_s && t_s < end_s) return true;
  }
  return false;
}

}  // namespace

double Serialiser::send(double t_s, std::size_t size) {
  free_s_ = std::max(t_s, free_s_) + static_cast<double>(size) * byte_s_;
  return free_s_;
}

Channel::Channel(const ChannelOptions& options, const Chance& chance) : options_(options), chance_(chance) {
  if (options_.corruption_ratio != 0.0) clean_ = clean_bytes();
}

std::optional<Arrival> Channel::carry(double t_s, std::string data) {
  if (options_.to_bad != 0.0 && is_lost()) return std::nullopt;
  const double delay_s = options_.latency_s + options_.jitter_s * (2.0 * chance_.number() - 1.0);
  const double arrival_s = std::max(t_s + std::max(delay_s, 0.0), last_s_);
  for (const auto& [start_s, end_s] : cuts) {
    if (t_s < end_s && arrival_s >= start_s) return std::nullopt;
  }
  last_s_ = arrival_s;
  if (options_.corruption_ratio != 0.0) corrupt(data);
  if (within(doubles, t_s)) data += std::string(data);
  if (waiting_.empty() && within(swaps, t_s)) {
    waiting_ = std::move(data);
    return std::nullopt;
  }
  data += waiting_;
  waiting_.clear();
  return Arrival{arrival_s, std::move(data)};
}

// Steps the chain by one chunk; its share of bad states is the loss ratio.
bool Channel::is_lost() {
  bad_ = chance_.number() < (bad_ ? 1.0 - options_.to_good : options_.to_bad);
  return bad_;
}

// How many bytes pass before the next corrupted one (geometric).
std::int64_t Channel::clean_bytes() {
  return static_cast<std::int64_t>(std::log(1.0 - chance_.number()) /
                                   std::log(1.0 - options_.corruption_ratio));
}

void Channel::corrupt(std::string& data) {
  const auto size = static_cast<std::int64_t>(data.size());
  if (clean_ >= size) {
    clean_ -= size;
    return;
  }
  std::int64_t at = clean_;
  while (at < size) {
    const auto other = static_cast<unsigned char>(1 + chance_.below(255));  // one bit differs at least
    data[static_cast<std::size_t>(at)] = static_cast<char>(data[static_cast<std::size_t>(at)] ^ other);
    at += 1 + clean_bytes();
  }
  clean_ = at - size;
}

}  // namespace twin
