// What the C++ written by translate.py stands on: Python's arithmetic, tuples, None, and traces, to the bit.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "asg_ism.hpp"
#include "exact.hpp"

namespace outer {

using Vec2 = std::tuple<double, double>;

// Where Python's arithmetic raises and C++'s does not. A law that does so ends the run.
class PythonError : public std::runtime_error {
 public:
  enum Kind { kZeroDivision, kValue, kOverflow, kType };
  PythonError(Kind kind, const char* text) : std::runtime_error(text), kind(kind) {}
  Kind kind;
};

namespace m {

struct None {};
using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;  // places in a trace

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double pi = 3.14159265358979323846;

inline double quotient(double a, double b) {
  if (b == 0.0) throw PythonError(PythonError::kZeroDivision, "float division by zero");
  return a / b;
}
inline double in_domain(double x, bool is) {
  if (!is) throw PythonError(PythonError::kValue, "math domain error");
  return x;
}
inline double power(double x, double y) {
  const double out = core::power(x, y);
  if (!std::isfinite(out) && std::isfinite(x) && std::isfinite(y)) {
    throw PythonError(PythonError::kOverflow, "Numerical result out of range");
  }
  return out;
}
inline double cos(double x) { return std::cos(in_domain(x, !std::isinf(x))); }
inline double sin(double x) { return std::sin(in_domain(x, !std::isinf(x))); }
// Where the library's result has no bound or is no number though `x` has one and is.
inline double in_range(double out, double x) {
  if (std::isinf(out) && std::isfinite(x)) throw PythonError(PythonError::kOverflow, "math range error");
  return out;
}
inline double exp(double x) { return in_range(std::exp(x), x); }
inline double expm1(double x) { return in_range(std::expm1(x), x); }
inline double sqrt(double x) { return std::sqrt(in_domain(x, !(x < 0.0))); }
inline double hypot(double a, double b) { return core::hypot(a, b); }
inline double copysign(double a, double b) { return std::copysign(a, b); }
inline bool isfinite(double a) { return std::isfinite(a); }
inline double abs(double a) { return std::fabs(a); }
// The first of two that are equal, or of which one is no number.
template <typename T>
T max(T a, T b) {
  return b > a ? b : a;
}
template <typename T>
T min(T a, T b) {
  return b < a ? b : a;
}

template <typename... T>
std::tuple<T...> tup(T... values) {
  return std::tuple<T...>(values...);
}

template <typename T>
int len(const std::vector<T>& of) {
  return static_cast<int>(of.size());
}
template <typename T>
T& element(std::vector<T>& of, int i) {
  return of.at(static_cast<std::size_t>(i));
}
template <typename T>
const T& element(const std::vector<T>& of, int i) {
  return of.at(static_cast<std::size_t>(i));
}
inline int bisect_right(const std::vector<double>& of, double x) {
  return static_cast<int>(std::upper_bound(of.begin(), of.end(), x) - of.begin());
}

template <std::size_t I>
struct Place {};
template <std::size_t I, typename... T>
const auto& item(const std::tuple<T...>& of) {
  return std::get<I>(of);
}
template <std::size_t I, typename... T>
auto& item(std::tuple<T...>& of) {
  return std::get<I>(of);
}
template <std::size_t I, typename T>
const T& item(const std::vector<T>& of) {
  return of.at(I);
}
template <std::size_t I, typename Struct>
auto item(const Struct& of) -> decltype(item_of(of, Place<I>{})) {
  return item_of(of, Place<I>{});
}

inline double element(const Vec2& of, int i) {
  if (i != 0 && i != 1) throw std::out_of_range("tuple index out of range");
  return i == 0 ? std::get<0>(of) : std::get<1>(of);
}

// What `of` makes of 0, 1, ..., in that order.
template <typename Of, int... I>
auto listed_of(Of of, std::integer_sequence<int, I...>) {
  return std::tuple<decltype(of(I))...>{of(I)...};
}
template <int N, typename Of>
auto listed(Of of) {
  return listed_of(of, std::make_integer_sequence<int, N>());
}

// Calls `to` with the first entries of tuples of one length, then with the second ones, ...
template <std::size_t I, typename To, typename... Tuples>
void at_each(To& to, Tuples&... of) {
  to(std::get<I>(of)...);
}
template <typename To, std::size_t... I, typename... Tuples>
void all_of(To& to, std::index_sequence<I...>, Tuples&... of) {
  (at_each<I>(to, of...), ...);
}
template <typename To, typename First, typename... Rest>
void each(To to, First&& first, Rest&&... rest) {
  constexpr std::size_t n = std::tuple_size_v<std::decay_t<First>>;
  static_assert(((std::tuple_size_v<std::decay_t<Rest>> == n) && ...), "zip of tuples of other lengths");
  all_of(to, std::make_index_sequence<n>(), first, rest...);
}

inline std::array<double, 2> both(double x) { return {x, x}; }

}  // namespace m

// A value or None; where it is used as a value it must be one.
template <typename T>
class Opt {
 public:
  Opt() = default;
  Opt(m::None) {}
  explicit Opt(const T& value) : is_(true), value_(value) {}
  Opt& operator=(const T& value) {
    is_ = true;
    value_ = value;
    return *this;
  }
  operator const T&() const {
    if (!is_) throw PythonError(PythonError::kType, "None where a number is needed");
    return value_;
  }
  bool is_none() const { return !is_; }

 private:
  bool is_ = false;
  T value_{};
};

namespace m {
template <typename T>
bool is_none(const Opt<T>& value) {
  return value.is_none();
}
}  // namespace m

constexpr std::size_t kTraceSlots = 36;  // names of translated laws, those of somebody's own behind them

// A law's trace: for each of kTraceKeys, and of the names of its own, a number or nothing.
class Trace {
 public:
  Trace&& with(std::size_t key, double value) && {
    set(key, value);
    return std::move(*this);
  }
  void set(std::size_t key, double value) {
    values_[key] = value;
    has_ |= std::uint64_t{1} << key;
  }
  bool has(std::size_t key) const { return (has_ >> key & 1) != 0; }
  // The value by that key, NaN for none.
  double get(std::size_t key) const { return has(key) ? values_[key] : m::nan; }
  friend Trace operator|(Trace a, const Trace& b) {  // of both, that of b
    for (std::size_t key = 0; key < kTraceSlots; ++key) {
      if (b.has(key)) a.values_[key] = b.values_[key];
    }
    a.has_ |= b.has_;
    return a;
  }

 private:
  std::array<double, kTraceSlots> values_{};
  std::uint64_t has_ = 0;
};

namespace m {
inline double element(const Trace& of, std::size_t key) { return of.get(key); }
}  // namespace m

// hil.control.AsgIsm of two dimensions, as the outer law calls it.
class AsgBlock {
 public:
  struct Gains {
    std::array<double, 2> k{}, eps_min{};
    double eps0 = 0.0, beta = 0.5, mu0_s = 1.0, sigma = 1.0;
    bool radial = false;
  };
  AsgBlock() : AsgBlock(Gains{}) {}
  explicit AsgBlock(const Gains& gains) : law_(native(gains)) {}

  void reset(const Vec2& p, const Vec2& q) { law_.reset(vec(p), vec(q)); }
  std::tuple<Vec2, Vec2, Vec2, Vec2, Vec2> terms(double t_s, const Vec2& p, const Vec2& q) {
    const control::AsgTerms& now = law_.observe(t_s, vec(p), vec(q));
    return {pair(now.s), pair(now.kappa), pair(now.psi), pair(now.dh), pair(now.eps)};
  }
  void advance(double dt_s) { law_.advance(dt_s); }
  void leave_out(bool kappa, bool gamma) {
    law_.without_kappa = kappa;
    law_.without_gamma = gamma;
  }

 private:
  static control::Vec vec(const Vec2& v) {
    control::Vec out{};
    std::tie(out[0], out[1]) = v;
    return out;
  }
  static Vec2 pair(const control::Vec& v) { return {v[0], v[1]}; }
  static control::AsgGains native(const Gains& gains) {
    control::AsgGains out;
    out.n = 2;
    for (int i = 0; i < 2; ++i) out.k[i] = gains.k[i], out.eps_min[i] = gains.eps_min[i];
    out.eps0 = gains.eps0;
    out.beta = gains.beta;
    out.mu0 = gains.mu0_s;
    out.sigma = gains.sigma;
    out.radial = gains.radial;
    return out;
  }

  control::AsgIsm law_;
};

}  // namespace outer
