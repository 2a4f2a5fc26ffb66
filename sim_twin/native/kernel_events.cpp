#include "kernel_events.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace twin {
namespace {

constexpr double kPi = 3.14159265358979323846;

std::uint64_t mixed(std::uint64_t z) {  // splitmix64, public domain (S. Vigna)
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

// Near-Gaussian value of knot k, mean 0, variance 1: sum of four uniforms of 16 bits.
double knot(std::uint64_t seed, std::int64_t k) {
  const std::uint64_t bits = mixed(mixed(seed) ^ static_cast<std::uint64_t>(k));
  double sum = 0.0;
  for (int shift = 0; shift < 64; shift += 16) sum += static_cast<double>((bits >> shift) & 0xffff);
  return (sum / 65536.0 - 2.0) * std::sqrt(3.0);
}

// Noise as a function of time, so that RK4 may ask for any instant: knots at twice the top of the
// band, Catmull-Rom between them (continuous slope), divided by the interpolation's own RMS gain.
double noise(std::uint64_t seed, double t_s, double frequency_hz) {
  const double position = 2.0 * frequency_hz * t_s;
  const double base = std::floor(position);
  const double u = position - base;
  const auto k = static_cast<std::int64_t>(base);
  const double p0 = knot(seed, k - 1), p1 = knot(seed, k);
  const double p2 = knot(seed, k + 1), p3 = knot(seed, k + 2);
  const double value =
      p1 + 0.5 * u * (p2 - p0 + u * (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3 + u * (3.0 * (p1 - p2) + p3 - p0)));
  return value / std::sqrt(57.0 / 70.0);  // mean over u of the sum of squared weights
}

double shape_value(const Disturbance& d, double t_s) {
  const double since_s = t_s - d.start_s;
  switch (d.shape) {
    case Shape::kSine: return direction(2.0 * kPi * d.frequency_hz * since_s + d.phase_rad).sin;
    case Shape::kPulse: return direction(kPi * since_s / (d.end_s - d.start_s)).sin;
    case Shape::kNoise: return noise(d.seed, since_s, d.frequency_hz);
    case Shape::kStep: break;
  }
  return 1.0;
}

double zone_weight(const Disturbance& d, double x_m, double y_m) {
  if (d.zone_radius_m <= 0.0) return 1.0;
  constexpr double kEdge_m = 0.01;
  const double dx_m = x_m - d.zone_x_m, dy_m = y_m - d.zone_y_m;
  const double inside_m = d.zone_radius_m - std::sqrt(dx_m * dx_m + dy_m * dy_m);
  return 0.5 + 0.5 * inside_m / std::sqrt(inside_m * inside_m + kEdge_m * kEdge_m);
}

// Noise on an encoder's wires: a pulse on both channels in the first 0.1 ms of each millisecond.
bool glitches(double t_s) { return std::fmod(t_s + 1e-9, 1e-3) < 1e-4; }

// When the next of the items begins or ends after t_s.
template <typename Item>
double next_change_s(const std::vector<Item>& items, double t_s) {
  double until_s = std::numeric_limits<double>::infinity();
  for (const Item& item : items) {
    if (t_s < item.end_s) until_s = std::min(until_s, t_s < item.start_s ? item.start_s : item.end_s);
  }
  return until_s;
}

}  // namespace

double disturbance_value(const Disturbance& d, double t_s, double x_m, double y_m) {
  if (t_s < d.start_s || t_s >= d.end_s) return 0.0;
  return d.amplitude * shape_value(d, t_s) * zone_weight(d, x_m, y_m);
}

LoadVector Disturbances::loads(double t_s, double x_m, double y_m) const {
  LoadVector out{};
  for (const Disturbance& d : items_) out[d.load] += disturbance_value(d, t_s, x_m, y_m);
  return out;
}

double Disturbances::steady_until_s(double t_s) const { return next_change_s(items_, t_s); }

bool Disturbances::at_work(double t_s) const {
  return std::any_of(items_.begin(), items_.end(),
                     [t_s](const Disturbance& d) { return d.start_s <= t_s && t_s < d.end_s; });
}

FaultState Faults::at(double t_s) const {
  FaultState out;
  for (const Fault& fault : items_) {
    if (t_s < fault.start_s || t_s >= fault.end_s) continue;
    if (fault.kind == FaultKind::kBoardReset) out.board_in_reset = true;
    if (fault.kind == FaultKind::kMotorsExchanged) out.motors_exchanged = true;
    if (fault.kind == FaultKind::kEncodersExchanged) out.encoders_exchanged = true;
    for (int i = 0; i < 2; ++i) {
      if (!(i == 0 ? fault.left : fault.right)) continue;
      FaultState::Side& side = out.side[i];
      switch (fault.kind) {
        case FaultKind::kDeadEncoder: side.dead_a = side.dead_b = true; break;
        case FaultKind::kDeadChannelA: side.dead_a = true; break;
        case FaultKind::kDeadChannelB: side.dead_b = true; break;
        case FaultKind::kSwappedPhases: side.swapped = true; break;
        case FaultKind::kEncoderNoise: side.glitch = glitches(t_s); break;
        case FaultKind::kGearSlip: side.grip *= fault.strength; break;
        case FaultKind::kMotorReversed: side.reversed = true; break;
        case FaultKind::kMotorStuck: side.stuck = true; break;
        case FaultKind::kMotorWeak: side.strength *= fault.strength; break;
        case FaultKind::kMotorsExchanged:
        case FaultKind::kEncodersExchanged:
        case FaultKind::kBoardReset: break;
      }
    }
  }
  return out;
}

double Faults::steady_until_s(double t_s) const {
  const bool noise = std::any_of(items_.begin(), items_.end(), [t_s](const Fault& fault) {
    return fault.kind == FaultKind::kEncoderNoise && fault.start_s <= t_s && t_s < fault.end_s;
  });
  return noise ? t_s : next_change_s(items_, t_s);
}

}  // namespace twin
