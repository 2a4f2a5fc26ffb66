// Differentiators (3.15), (6.15)-(6.16) and the filters of the cascades.
#pragma once

#include <algorithm>

#include "law.hpp"

namespace control {

// Super-twisting: e = x_hat - x, x_hat' = z - l1 sqrt(L) sqrt|e| sgn(e), z' = -l0 L sgn(e).
// Implicit Euler solves the same with e at the end of the step: no chatter where nothing moves.
class SuperTwisting {
 public:
  SuperTwisting(double bound, double l1, double l0, bool implicit)
      : bound_(bound), l1_(l1), l0_(l0), implicit_(implicit) {}
  void reset(double x, double rate) {
    x_hat_ = x;
    z_ = rate;
  }
  // Returns the estimated rate at the sample x and moves on by h.
  double step(double x, double h) { return implicit_ ? implicit_step(x, h) : explicit_step(x, h); }
  void set_bound(double bound) { bound_ = bound; }
  double error() const { return e_; }

 private:
  double explicit_step(double x, double h) {
    e_ = x_hat_ - x;
    const double rate = z_ - l1_ * std::sqrt(bound_ * std::abs(e_)) * sign(e_);
    x_hat_ += h * rate;
    z_ -= h * l0_ * bound_ * sign(e_);
    return rate;
  }
  // With b = x_hat + h z - x: e + h l1 sqrt(L|e|) sgn + h^2 l0 L Sgn(e) = b, one root (or e = 0).
  double implicit_step(double x, double h) {
    const double b = x_hat_ + h * z_ - x;
    const double hold = h * h * l0_ * bound_;
    double rate;
    if (std::abs(b) <= hold) {
      e_ = 0.0;
      z_ -= b / h;
      rate = z_;
    } else {
      const double half = 0.5 * h * l1_ * std::sqrt(bound_);
      const double root = -half + std::sqrt(half * half + std::abs(b) - hold);
      e_ = root * root * sign(b);
      z_ -= h * l0_ * bound_ * sign(b);
      rate = z_ - l1_ * std::sqrt(bound_) * root * sign(b);
    }
    x_hat_ = x + e_;
    return rate;
  }

  double bound_, l1_, l0_;
  bool implicit_;
  double x_hat_ = 0.0, z_ = 0.0, e_ = 0.0;
};

// The variable gain of (3.15): it grows while the sign of the error does not switch (its average,
// the equivalent value, is near 1) and falls while it does; kept within [low, high].
class VariableGain {
 public:
  VariableGain(double low, double high, double rate, double threshold, double average_s)
      : low_(low), high_(high), rate_(rate), threshold_(threshold), average_s_(average_s), gain_(low) {}
  double step(double error, double h) {
    average_ += h / average_s_ * (sign(error) - average_);
    gain_ = std::clamp(gain_ + h * rate_ * gain_ * sign(std::abs(average_) - threshold_), low_, high_);
    return gain_;
  }

 private:
  double low_, high_, rate_, threshold_, average_s_, gain_, average_ = 0.0;
};

// First order: y' = (x - y)/tau. Returns y' and moves y on.
class LowPass {
 public:
  explicit LowPass(double tau_s) : tau_s_(tau_s) {}
  void reset(double x) { y_ = x; }
  double value() const { return y_; }
  double step(double x, double h) {
    const double rate = (x - y_) / tau_s_;
    y_ += h * rate;
    return rate;
  }

 private:
  double tau_s_, y_ = 0.0;
};

// Critically damped second order: a command made smooth, with its rate and acceleration.
class SmoothCommand {
 public:
  explicit SmoothCommand(double rate_rad_s) : w_(rate_rad_s) {}
  void reset(double x) {
    y_ = x;
    y1_ = y2_ = 0.0;
  }
  double value() const { return y_; }
  double rate() const { return y1_; }
  double acceleration(double x) const { return w_ * w_ * (x - y_) - 2.0 * w_ * y1_; }
  void step(double x, double h) {
    y2_ = acceleration(x);
    y_ += h * y1_;
    y1_ += h * y2_;
  }

 private:
  double w_, y_ = 0.0, y1_ = 0.0, y2_ = 0.0;
};

}  // namespace control
