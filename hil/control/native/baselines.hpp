// What the proposed law is compared with: state feedback (PD, PID, P), classical sliding mode (3.2),
// Utkin's integral sliding mode (3.9)-(3.14). All act on the same (p, q) and give the same w.
#pragma once

#include "law.hpp"

namespace control {

// w = -kp p - kd q - ki * integral of p. With p the integral of an error and q the error itself,
// kd is its P gain and kp its I gain.
class StateFeedback : public Law {
 public:
  StateFeedback(int n, const Vec& kp, const Vec& kd, const Vec& ki) : n_(n), kp_(kp), kd_(kd), ki_(ki) {}
  int dim() const override { return n_; }
  void reset(const Vec&, const Vec&) override { sum_ = {}; }
  Vec output(double, const Vec& p, const Vec& q, double) override {
    p_ = p;
    q_ = q;
    Vec w{};
    for (int i = 0; i < n_; ++i) w[i] = -kp_[i] * p[i] - kd_[i] * q[i] - ki_[i] * sum_[i];
    return w;
  }
  Vec rate(const Vec& q_dot) override {
    Vec w{};
    for (int i = 0; i < n_; ++i) w[i] = -kp_[i] * q_[i] - kd_[i] * q_dot[i] - ki_[i] * p_[i];
    return w;
  }
  void advance(double dt_s) override {
    for (int i = 0; i < n_; ++i) sum_[i] += p_[i] * dt_s;
  }

 private:
  int n_;
  Vec kp_, kd_, ki_, sum_{}, p_{}, q_{};
};

// s = q + c p, w = -c q - k s/(||s|| + eps): it has to reach s = 0 first.
class SlidingMode : public Law {
 public:
  SlidingMode(int n, const Vec& c, const Vec& k, const Vec& eps, bool componentwise)
      : n_(n), c_(c), k_(k), eps_(eps), layer_{componentwise} {}
  int dim() const override { return n_; }
  void reset(const Vec&, const Vec&) override { s_ = {}; }
  Vec output(double, const Vec& p, const Vec& q, double) override {
    q_ = q;
    for (int i = 0; i < n_; ++i) s_[i] = q[i] + c_[i] * p[i];
    Vec w{};
    for (int i = 0; i < n_; ++i) w[i] = -c_[i] * q[i] - k_[i] * layer_.unit(s_, n_, i, eps_[i]);
    return w;
  }
  Vec rate(const Vec& q_dot) override {
    Vec s_dot{}, w{};
    for (int i = 0; i < n_; ++i) s_dot[i] = q_dot[i] + c_[i] * q_[i];
    for (int i = 0; i < n_; ++i) {
      w[i] = -c_[i] * q_dot[i] - k_[i] * layer_.unit_rate(s_, s_dot, n_, i, eps_[i]);
    }
    return w;
  }
  void advance(double) override {}
  double s_norm() const override { return norm(s_, n_); }

 private:
  int n_;
  Vec c_, k_, eps_;
  Layer layer_;
  Vec s_{}, q_{};
};

// s = q - q(0) - integral of w0, w0 = -kp p - kd q (3.14): no reaching phase, and on s = 0 the error
// obeys the nominal loop dq/dt = w0 whatever disturbs it.
class UtkinIsm : public Law {
 public:
  UtkinIsm(int n, const Vec& kp, const Vec& kd, const Vec& k, const Vec& eps, bool componentwise)
      : n_(n), kp_(kp), kd_(kd), k_(k), eps_(eps), layer_{componentwise} {}
  int dim() const override { return n_; }
  void reset(const Vec&, const Vec& q) override { z_ = q; }
  Vec output(double, const Vec& p, const Vec& q, double) override {
    q_ = q;
    Vec w{};
    for (int i = 0; i < n_; ++i) {
      nominal_[i] = -kp_[i] * p[i] - kd_[i] * q[i];
      s_[i] = q[i] - z_[i];
    }
    for (int i = 0; i < n_; ++i) w[i] = nominal_[i] - k_[i] * layer_.unit(s_, n_, i, eps_[i]);
    return w;
  }
  Vec rate(const Vec& q_dot) override {
    Vec s_dot{}, w{};
    for (int i = 0; i < n_; ++i) s_dot[i] = q_dot[i] - nominal_[i];
    for (int i = 0; i < n_; ++i) {
      w[i] = -kp_[i] * q_[i] - kd_[i] * q_dot[i] - k_[i] * layer_.unit_rate(s_, s_dot, n_, i, eps_[i]);
    }
    return w;
  }
  void advance(double dt_s) override {
    for (int i = 0; i < n_; ++i) z_[i] += nominal_[i] * dt_s;
  }
  double s_norm() const override { return norm(s_, n_); }

 private:
  int n_;
  Vec kp_, kd_, k_, eps_;
  Layer layer_;
  Vec z_{}, nominal_{}, s_{}, q_{};
};

}  // namespace control
