// Arithmetic that the interpreter's `math` does in its own way, here with the same bits.
#pragma once

#include <cmath>
#include <cstdint>

namespace core {

// x to the power y by the library; a compiler would make products of small whole exponents, which round
// otherwise.
inline double power(double x, double y) {
  volatile double exponent = y;
  return std::pow(x, exponent);
}

// The whole number nearest to x, halves to the even one.
inline std::int64_t rounded(double x) { return static_cast<std::int64_t>(std::nearbyint(x)); }

// math.hypot of two numbers: the root of a sum kept in three parts, corrected once by what it leaves.
inline double hypot(double a, double b) {
  constexpr double kSplit = 134217729.0;  // 2^27 + 1
  const double values[2] = {std::fabs(a), std::fabs(b)};
  const double most = values[0] > values[1] ? values[0] : values[1];
  if (std::isinf(values[0]) || std::isinf(values[1])) return INFINITY;
  if (std::isnan(a) || std::isnan(b)) return NAN;
  int exponent = 0;
  if (most == 0.0 || most < 2.3e-308) return std::hypot(a, b);
  std::frexp(most, &exponent);
  const double scale = std::ldexp(1.0, -exponent);
  double sum = 1.0, rest1 = 0.0, rest2 = 0.0, rest3 = 0.0;
  const auto add = [&sum](double x, double& rest) {
    const double before = sum;
    sum += x;
    rest += (before - sum) + x;
  };
  for (const double value : values) {
    const double x = value * scale, t = x * kSplit, high = t - (t - x), low = x - high;
    add(high * high, rest1);
    add(2.0 * high * low, rest2);
    rest3 += low * low;
  }
  const double root = std::sqrt(sum - 1.0 + (rest1 + rest2 + rest3));
  const double t = root * kSplit, high = t - (t - root), low = root - high;
  add(-high * high, rest1);
  add(-2.0 * high * low, rest2);
  add(-low * low, rest3);
  const double left = sum - 1.0 + (rest1 + rest2 + rest3);
  return (root + left / (2.0 * root)) / scale;
}

}  // namespace core
