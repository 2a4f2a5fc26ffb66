#include "rig.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace twin {
namespace {

constexpr double kBitsPerByte = 10.0;  // start, eight data, stop
constexpr double kFar_s = std::numeric_limits<double>::infinity();

}  // namespace

Rig::Rig(Kernel& kernel, const RigOptions& options, const Channel& down, const Channel& up,
         const Shutter& shutter)
    : kernel_(kernel), options_(options), down_(down), up_(up), port_(kBitsPerByte / options.baud),
      shutter_(shutter), now_s_(options.start_s) {}

void Rig::set_spans(std::vector<Span> stalls, std::vector<Span> hidden) {
  stalls_ = std::move(stalls);
  hidden_ = std::move(hidden);
  if (!begun_) next_frame_ = shutter_.next(stalls_);
  begun_ = true;
}

// The first whole microsecond of the kernel's clock not before host time t_s.
std::int64_t Rig::kernel_us(double t_s) const {
  return static_cast<std::int64_t>(std::ceil(1e6 * (t_s - options_.start_s) - 1e-3));
}

void Rig::wait(double until_s, int poses) {
  do {
    advance(until_s);
  } while (!arrive(until_s, poses));
}

void Rig::advance(double until_s) { reached(kernel_.advance(aim(until_s))); }

std::int64_t Rig::aim(double until_s) {
  const double frame_s = next_frame_ ? next_frame_->arrival_s : kFar_s;
  const double bytes_s = uplink_.empty() ? kFar_s : uplink_.front().first;
  target_s_ = std::min(std::min(until_s, frame_s), bytes_s);
  carry(target_s_);
  target_us_ = kernel_us(target_s_);
  return target_us_;
}

bool Rig::arrive(double until_s, int poses) {
  for (Chunk& chunk : kernel_.take_sent()) {
    const double left_s = options_.start_s + 1e-6 * static_cast<double>(chunk.t_us);
    if (auto carried = up_.carry(left_s, std::move(chunk.bytes))) uplink_.push_back(*std::move(carried));
  }
  if (!reached_) return false;  // the board has sent bytes on the way: they may arrive sooner
  now_s_ = std::max(now_s_, target_s_);
  return take_arrivals(poses) || target_s_ >= until_s;
}

bool Rig::take_arrivals(int poses) {
  bool arrived = false;
  for (; !uplink_.empty() && uplink_.front().first <= now_s_; uplink_.pop_front()) {
    arrived_ += uplink_.front().second;
    arrived = true;
  }
  for (; next_frame_ && next_frame_->arrival_s <= now_s_; next_frame_ = shutter_.next(stalls_)) {
    exposed_.push_back({*next_frame_, poses_over(*next_frame_, poses)});
    arrived = true;
  }
  return arrived;
}

std::string Rig::read() {
  std::string out;
  out.swap(arrived_);
  return out;
}

void Rig::send(const std::string& data) {
  const double left_s = port_.send(now_s_, data.size());
  const double takes_s = static_cast<double>(data.size()) * kBitsPerByte / options_.baud;
  unsent_.push_back({left_s - takes_s, left_s, data});
}

void Rig::discard_unsent() {
  unsent_.clear();
  port_ = Serialiser(kBitsPerByte / options_.baud);
}

// Hands the radio what begins to leave the port by until_s.
void Rig::carry(double until_s) {
  for (; !unsent_.empty() && unsent_.front().begins_s <= until_s; unsent_.pop_front()) {
    Unsent& first = unsent_.front();
    if (auto carried = down_.carry(first.left_s, std::move(first.data))) {
      kernel_.receive(kernel_us(carried->first), std::move(carried->second));
    }
  }
}

std::optional<Exposed> Rig::take_frame() {
  if (exposed_.empty()) return std::nullopt;
  Exposed out = std::move(exposed_.front());
  exposed_.pop_front();
  return out;
}

PoseSample Rig::pose_at(double t_s) const {
  const double t_us = 1e6 * (t_s - options_.start_s);
  return kernel_.pose_at(std::min(std::max(t_us, 0.0), static_cast<double>(kernel_.time_us())));
}

std::vector<PoseSample> Rig::poses_over(const Exposure& exposure, int poses) const {
  for (const auto& [start_s, end_s] : hidden_) {
    if (start_s <= exposure.start_s && exposure.start_s < end_s) return {};
  }
  if (poses == 1) return {pose_at(0.5 * (exposure.start_s + exposure.end_s))};
  // A rolling shutter's first and last rows are exposed earlier and later than the middle one.
  const double rows_s = 0.5 * options_.readout_s;
  const double step_s = (exposure.end_s - exposure.start_s + 2.0 * rows_s) / (poses - 1);
  std::vector<PoseSample> out;
  for (int i = 0; i < poses; ++i) out.push_back(pose_at(exposure.start_s - rows_s + i * step_s));
  return out;
}

}  // namespace twin
