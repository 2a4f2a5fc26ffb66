// The averaged sub-gradient integral sliding mode in n dimensions, (4.12)-(4.16), (4.20), (4.24):
//
//   s     = q + mu (p + eta) + Psi,   mu = 1/(t + mu0),   Psi = mu * integral of sigma sgn(p)
//   eta   = -p(0) - mu0 q(0)          so that s(0) = 0
//   kappa = mu (q + sigma sgn(p) - Psi) - mu^2 (p + eta)      so that ds/dt = dq/dt + kappa
//   w     = -kappa - kd q - k s/(||s|| + eps(t))
//   eps   = max(eps0 mu^(1 + beta), eps_min)
//
// With `dominating` the gain law (4.14) as printed: no -kappa in w, the gain outweighs it instead,
// k(t) = k + 2 (||kappa|| + |d eps/dt|).
//
// Three extensions, all off by default: `radial` takes the cost H = sigma ||p||, whose sub-gradient
// sigma p/||p|| does not depend on the axes, in place of sigma sum |p_i|; mu stops falling at mu_min (d mu/dt = 0 from there), and the
// sliding term in implicit form, -P(s)/h with P the projection on the ball of radius k h.
#pragma once

#include <algorithm>

#include "law.hpp"

namespace control {

struct AsgGains {
  int n = 1;
  Vec k{};        // gain of the sliding term; one value in every entry unless componentwise
  Vec eps_min{};  // floor of the layer
  Vec kd{};       // extra damping on q, as table 4.3 has it
  double eps0 = 0.0, beta = 0.5;
  double mu0 = 1.0, mu_min = 0.0;
  double sigma = 1.0;  // scale of the cost H = sigma sum |p_i|
  bool componentwise = false, implicit = false, dominating = false, radial = false;
};

struct AsgTerms {
  Vec s{}, psi{}, kappa{}, dh{}, eps{};
  double mu = 0.0;
};

class AsgIsm : public Law {
 public:
  explicit AsgIsm(const AsgGains& gains) : gains_(gains) {}

  int dim() const override { return gains_.n; }
  double cost(const Vec& p) const {
    if (gains_.radial) return gains_.sigma * norm(p, gains_.n);
    double sum = 0.0;
    for (int i = 0; i < gains_.n; ++i) sum += std::abs(p[i]);
    return gains_.sigma * sum;
  }
  const Vec& eta() const { return eta_; }
  const Vec& averaged() const { return sum_; }  // integral of the sub-gradient

  // Parts left out, to see what each is worth: kappa is zero; eta is that of p(0) = q(0) = 0, so that s starts
  // at q(0) + mu p(0) and has to be reached.
  bool without_kappa = false, without_gamma = false;

  void reset(const Vec& p0, const Vec& q0) override {
    const Vec p = without_gamma ? Vec{} : p0, q = without_gamma ? Vec{} : q0;
    sum_ = {};
    for (int i = 0; i < gains_.n; ++i) eta_[i] = -p[i] - gains_.mu0 * q[i];
    last_ = {};
  }

  // The terms of this tick, for who forms an output of them; advance goes on from here.
  const AsgTerms& observe(double t_s, const Vec& p, const Vec& q) {
    last_ = terms(t_s, p, q);
    q_ = q;
    floored_ = 1.0 / (t_s + gains_.mu0) <= gains_.mu_min;
    return last_;
  }

  Vec output(double t_s, const Vec& p, const Vec& q, double dt_s) override {
    observe(t_s, p, q);
    Vec w{};
    for (int i = 0; i < gains_.n; ++i) {
      const double kappa = gains_.dominating ? 0.0 : last_.kappa[i];
      w[i] = -kappa - gains_.kd[i] * q[i] - reaching(i, dt_s);
    }
    return w;
  }

  Vec rate(const Vec& q_dot) override {
    const AsgTerms& now = last_;
    const double mu = now.mu;
    Vec s_dot{}, w_dot{};
    for (int i = 0; i < gains_.n; ++i) s_dot[i] = q_dot[i] + now.kappa[i];
    const Layer layer{gains_.componentwise};
    for (int i = 0; i < gains_.n; ++i) {
      // kappa = mu (q + dh - Psi) - mu pulled, each with its own rate; d mu/dt = -mu^2 or 0
      const double pulled = now.s[i] - q_[i] - now.psi[i];
      const double kappa_dot =
          gains_.dominating ? 0.0
          : floored_        ? mu * q_dot[i]
                            : mu * q_dot[i] - 2.0 * mu * mu * (q_[i] - pulled + now.dh[i] - now.psi[i]);
      w_dot[i] = -kappa_dot - gains_.kd[i] * q_dot[i] -
                 gain(i) * layer.unit_rate(now.s, s_dot, gains_.n, i, now.eps[i]);
    }
    return w_dot;
  }

  void advance(double dt_s) override {
    for (int i = 0; i < gains_.n; ++i) sum_[i] += last_.dh[i] * dt_s;
  }

  double s_norm() const override { return norm(last_.s, gains_.n); }

 private:
  AsgTerms terms(double t_s, const Vec& p, const Vec& q) const {
    AsgTerms out;
    const double falling = 1.0 / (t_s + gains_.mu0);
    const bool floored = falling <= gains_.mu_min;
    out.mu = floored ? gains_.mu_min : falling;
    const double layer = gains_.eps0 * std::pow(falling, 1.0 + gains_.beta);
    const double length = gains_.radial ? norm(p, gains_.n) : 0.0;
    for (int i = 0; i < gains_.n; ++i) {
      out.dh[i] = !gains_.radial ? gains_.sigma * sign(p[i])
                  : length > 0.0 ? gains_.sigma * p[i] / length
                                 : 0.0;
      out.psi[i] = out.mu * sum_[i];
      const double pulled = out.mu * (p[i] + eta_[i]);
      out.s[i] = q[i] + pulled + out.psi[i];
      out.kappa[i] =
          floored ? out.mu * (q[i] + out.dh[i]) : out.mu * (q[i] - pulled + out.dh[i] - out.psi[i]);
      out.eps[i] = std::max(layer, gains_.eps_min[i]);
    }
    if (without_kappa) out.kappa = {};
    return out;
  }

  double gain(int i) const {
    if (!gains_.dominating) return gains_.k[i];
    const double mu = last_.mu, layer = gains_.eps0 * std::pow(mu, 1.0 + gains_.beta);
    const double eps_dot = layer > gains_.eps_min[i] ? (1.0 + gains_.beta) * layer * mu : 0.0;
    return gains_.k[i] + 2.0 * (norm(last_.kappa, gains_.n) + eps_dot);
  }

  double reaching(int i, double dt_s) const {
    const Layer layer{gains_.componentwise};
    const double k = gain(i);
    if (!gains_.implicit) return k * layer.unit(last_.s, gains_.n, i, last_.eps[i]);
    const double length = layer.size(last_.s, gains_.n, i);
    return length <= k * dt_s ? last_.s[i] / dt_s : k * last_.s[i] / length;
  }

  AsgGains gains_;
  Vec eta_{}, sum_{}, q_{};
  AsgTerms last_;
  bool floored_ = false;
};

}  // namespace control
