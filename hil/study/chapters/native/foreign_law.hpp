// A law written in Python: reset(p, q) and output(t_s, p, q, dt_s); rate(q_dot) and advance(dt_s)
// where it has them. Without rate, dw/dt is the difference of the latest two outputs.
#pragma once

#include <nanobind/nanobind.h>

#include <stdexcept>
#include <string>

#include "law.hpp"

namespace chapters {

class ForeignLaw : public control::Law {
 public:
  ForeignLaw(nanobind::object law, int n) : law_(std::move(law)), n_(n) {
    has_rate_ = nanobind::hasattr(law_, "rate");
    has_advance_ = nanobind::hasattr(law_, "advance");
  }
  int dim() const override { return n_; }
  void reset(const control::Vec& p, const control::Vec& q) override {
    law_.attr("reset")(tuple(p), tuple(q));
    ticks_ = 0;
  }
  control::Vec output(double t, const control::Vec& p, const control::Vec& q, double h) override {
    before_ = latest_;
    latest_ = vec(law_.attr("output")(t, tuple(p), tuple(q), h));
    dt_ = h;
    ++ticks_;
    return latest_;
  }
  control::Vec rate(const control::Vec& q_dot) override {
    if (has_rate_) return vec(law_.attr("rate")(tuple(q_dot)));
    control::Vec out{};
    for (int i = 0; i < n_ && ticks_ > 1; ++i) out[i] = (latest_[i] - before_[i]) / dt_;
    return out;
  }
  void advance(double h) override {
    if (has_advance_) law_.attr("advance")(h);
  }

 private:
  nanobind::object tuple(const control::Vec& values) const {
    nanobind::list out;
    for (int i = 0; i < n_; ++i) out.append(values[i]);
    return nanobind::tuple(out);
  }
  control::Vec vec(const nanobind::object& values) const {
    control::Vec out{};
    int count = 0;
    for (nanobind::handle value : values) {
      if (count < n_) out[count] = nanobind::cast<double>(nanobind::float_(value));
      ++count;
    }
    if (count != n_) {
      throw std::invalid_argument("the law returned " + std::to_string(count) + " values for " +
                                  std::to_string(n_) + " axes");
    }
    return out;
  }

  nanobind::object law_;
  int n_;
  bool has_rate_, has_advance_;
  control::Vec latest_{}, before_{};
  double dt_ = 0.0;
  int ticks_ = 0;
};

}  // namespace chapters
