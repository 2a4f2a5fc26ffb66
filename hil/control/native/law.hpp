// One stage of a cascade as every chapter has it: a pair (p, q) with dp/dt = q, and an output w that
// is the wanted dq/dt. A law knows neither the plant nor a clock: time and step are arguments.
#pragma once

#include <array>
#include <cmath>

namespace control {

constexpr int kMaxDim = 6;
using Vec = std::array<double, kMaxDim>;  // the first n entries count

inline double sign(double x) { return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0; }

inline double norm(const Vec& a, int n) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += a[i] * a[i];
  return std::sqrt(sum);
}

// One tick is output, rate where the stage above needs it, then advance.
class Law {
 public:
  virtual ~Law() = default;
  virtual int dim() const = 0;
  virtual void reset(const Vec& p, const Vec& q) = 0;
  virtual Vec output(double t_s, const Vec& p, const Vec& q, double dt_s) = 0;
  // dw/dt of the latest output for a known dq/dt, sgn held: the feed-forward of the next stage.
  virtual Vec rate(const Vec& q_dot) = 0;
  // Integrates what the law keeps over dt_s; not called while an output is limited.
  virtual void advance(double dt_s) = 0;
  // The sliding variable of the latest output; 0 for a law without one.
  virtual double s_norm() const { return 0.0; }
};

// s/(||s|| + eps) of the whole vector, or of each component by itself.
struct Layer {
  bool componentwise = false;
  double size(const Vec& s, int n, int i) const { return componentwise ? std::abs(s[i]) : norm(s, n); }
  double unit(const Vec& s, int n, int i, double eps) const { return s[i] / (size(s, n, i) + eps); }
  double unit_rate(const Vec& s, const Vec& s_dot, int n, int i, double eps) const {
    const double length = size(s, n, i);
    double along = 0.0;  // d||s||/dt
    if (length > 1e-9) {
      if (componentwise) {
        along = s[i] * s_dot[i];
      } else {
        for (int j = 0; j < n; ++j) along += s[j] * s_dot[j];
      }
      along /= length;
    }
    const double wide = length + eps;
    return s_dot[i] / wide - s[i] * along / (wide * wide);
  }
};

}  // namespace control
