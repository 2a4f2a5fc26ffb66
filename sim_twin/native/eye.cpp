#include "eye.hpp"

#include <algorithm>
#include <cmath>

namespace twin {
namespace {

constexpr double kPi = 3.14159265358979323846;

// To [-pi, pi), as hil.core.types.wrap_pi.
double wrapped(double angle_rad) {
  constexpr double kTurn = 2.0 * kPi;
  double rest = std::fmod(angle_rad + kPi, kTurn);
  if (rest < 0.0) rest += kTurn;
  return (rest == 0.0 ? 0.0 : rest) - kPi;
}

}  // namespace

std::optional<Exposure> Shutter::next(const std::vector<Span>& stalls) {
  while (true) {
    skip(stalls);
    if (index_ < 0) return std::nullopt;
    const Exposure exposure = expose();
    ++index_;
    if (chance_.number() >= options_.drop_ratio) {
      last_arrival_s_ = exposure.arrival_s;
      return exposure;
    }
    if (options_.drop_ratio >= 1.0) return std::nullopt;
  }
}

// Moves on to the first frame whose exposure starts outside every stall.
void Shutter::skip(const std::vector<Span>& stalls) {
  for (const auto& [start_s, end_s] : stalls) {
    const double t_s = options_.t_first_s + static_cast<double>(index_) * options_.period_s;
    if (!(start_s <= t_s && t_s < end_s)) continue;
    if (std::isinf(end_s)) {
      index_ = -1;
      return;
    }
    index_ = static_cast<std::int64_t>(std::ceil((end_s - options_.t_first_s) / options_.period_s));
  }
}

Exposure Shutter::expose() {
  const ShutterOptions& o = options_;
  const double start_s = o.t_first_s + static_cast<double>(index_) * o.period_s;
  const double end_s = start_s + o.exposure_s;
  const double middle_s = 0.5 * (start_s + end_s);
  const double spread = std::min(std::max(chance_.normal(), -o.most_sigmas), o.most_sigmas);
  const double arrival_s = middle_s + o.latency_s + o.jitter_s * spread;
  const double clock_s = o.clock_start_s + (middle_s - o.t_first_s) * o.clock_rate;
  return {index_, start_s, end_s, clock_s, std::max(std::max(arrival_s, end_s), last_arrival_s_)};
}

DrawnPoses::DrawnPoses(const DrawnOptions& options, const Chance& chance)
    : options_(options), chance_(chance) {
  for (Waves& waves : places_) {
    for (Wave& one : waves) one = wave();
  }
}

Wave DrawnPoses::wave() {
  const auto between = [this](double low, double high) { return low + (high - low) * chance_.number(); };
  const double number = 2.0 * kPi / between(kShortest_m, kLongest_m);
  const double way = between(-kPi, kPi);
  const double turns = static_cast<double>(chance_.below(2 * kMostPerTurn + 1)) - kMostPerTurn;
  return {number * std::cos(way), number * std::sin(way), turns, between(-kPi, kPi)};
}

double DrawnPoses::bias(const Waves& waves, const PoseSample& pose) {
  double total = 0.0;
  for (const Wave& w : waves) {
    total += std::sin(w.per_x * pose.x_m + w.per_y * pose.y_m + w.turns * pose.theta_rad + w.phase);
  }
  return total * std::sqrt(2.0 / static_cast<double>(waves.size()));
}

std::optional<PoseSample> DrawnPoses::measure(const PoseSample& pose) {
  const DrawnOptions& o = options_;
  const double draw = chance_.number();
  if (draw < o.not_seen_ratio) return std::nullopt;
  const bool outlier = draw > 1.0 - o.outlier_ratio;
  const double xy_m = outlier ? o.outlier_xy_m : o.sigma_xy_m;
  const double turn_rad = outlier ? o.outlier_theta_rad : o.sigma_theta_rad;
  PoseSample seen = pose;
  if (o.swapped) {
    seen = {pose.x_m + o.shift_m * std::cos(pose.theta_rad), pose.y_m + o.shift_m * std::sin(pose.theta_rad),
            pose.theta_rad + kPi};
  }
  const double stands = std::sqrt(o.place_ratio), fresh = std::sqrt(1.0 - o.place_ratio);
  double off[3];
  for (std::size_t i = 0; i < 3; ++i) {
    off[i] = stands * bias(places_[i], pose) + fresh * chance_.normal();
  }
  return PoseSample{seen.x_m + xy_m * off[0], seen.y_m + xy_m * off[1],
                    wrapped(seen.theta_rad + turn_rad * off[2])};
}

}  // namespace twin
