// What one run of a study leaves behind: integrals, peaks, how it ended, and thinned samples.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace chapters {

using Vec3 = std::array<double, 3>;

inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline double clip(double x, double limit) { return x > limit ? limit : x < -limit ? -limit : x; }

enum class End { complete, tumbled, diverged, not_finite };

struct Outcome {
  double ise = 0.0, ise_late = 0.0;          // integral of |e|^2; late: after the settling time
  double worst_late = 0.0, cost_late = 0.0;  // largest |e| and sum |e_i| after the settling time
  double worst_end = 0.0;                    // largest |e| of the last 50 s
  double effort = 0.0, effort_early = 0.0;   // integral of |u|^2; early: the first 5 s
  double peak_early = 0.0, peak_late = 0.0;  // largest |u|^2 before and after the study's early_s
  double peak = 0.0;                         // largest |u_i|
  double tilt_late = 0.0;                    // largest pitch after the settling time, rad
  double integral_cost = 0.0;                // sum |integral of e_i| at the end, where a law has it
  double rate_rms = 0.0;                     // error of the estimated rate after the settling time
  Vec3 s_max{};                              // largest ||s|| of each stage
  double end_s = 0.0;
  End end = End::complete;
  std::vector<double> samples;  // row after row
};

struct Clock {
  double duration, h, settle, early, give_up;
  int every;  // ticks between samples
};

class Tally {
 public:
  explicit Tally(const Clock& clock) : clock_(clock) {}

  // Adds the tick at t; says whether the run goes on.
  bool add(double t, const Vec3& e, double u2) {
    const double e2 = dot(e, e), h = clock_.h;
    out.end_s = t;
    if (!std::isfinite(e2) || !std::isfinite(u2)) return stop(End::not_finite);
    const double size = std::sqrt(e2);
    out.ise += h * e2;
    out.effort += h * u2;
    if (t < 5.0) out.effort_early += h * u2;
    double& peak = t < clock_.early ? out.peak_early : out.peak_late;
    peak = std::max(peak, u2);
    if (t > clock_.settle) {
      out.ise_late += h * e2;
      out.worst_late = std::max(out.worst_late, size);
      out.cost_late = std::max(out.cost_late, std::abs(e[0]) + std::abs(e[1]) + std::abs(e[2]));
    }
    if (t > clock_.duration - 50.0) out.worst_end = std::max(out.worst_end, size);
    return size < clock_.give_up || stop(End::diverged);
  }
  bool stop(End end) {
    out.end = end;
    return false;
  }
  void finish() {
    if (out.end == End::complete) out.end_s = clock_.duration;
  }

  Outcome out;

 private:
  Clock clock_;
};

// Sines and cosines of N rates, advanced by a fixed dt: a rotation each instead of two functions
// (1e-10 off after a million steps).
template <std::size_t N>
struct Waves {
  std::array<double, N> s{}, c{}, by_s{}, by_c{};
  Waves(const std::array<double, N>& rates, double dt, double t = 0.0) {
    for (std::size_t i = 0; i < N; ++i) {
      s[i] = std::sin(rates[i] * t);
      c[i] = std::cos(rates[i] * t);
      by_s[i] = std::sin(rates[i] * dt);
      by_c[i] = std::cos(rates[i] * dt);
    }
  }
  void advance() {
    for (std::size_t i = 0; i < N; ++i) {
      const double next = s[i] * by_c[i] + c[i] * by_s[i];
      c[i] = c[i] * by_c[i] - s[i] * by_s[i];
      s[i] = next;
    }
  }
};

template <std::size_t N, class Rates>
std::array<double, N> rk4(const Rates& rates, double t, const std::array<double, N>& x, double h) {
  const auto moved = [&x](const std::array<double, N>& k, double step) {
    std::array<double, N> out;
    for (std::size_t i = 0; i < N; ++i) out[i] = x[i] + step * k[i];
    return out;
  };
  const auto a = rates(t, x);
  const auto b = rates(t + 0.5 * h, moved(a, 0.5 * h));
  const auto c = rates(t + 0.5 * h, moved(b, 0.5 * h));
  const auto d = rates(t + h, moved(c, h));
  std::array<double, N> out;
  for (std::size_t i = 0; i < N; ++i) out[i] = x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
  return out;
}

}  // namespace chapters
