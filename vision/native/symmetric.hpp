// Three unknowns of a mark and their symmetric matrices.
#pragma once

#include <array>
#include <optional>

namespace vision {

using Move = std::array<double, 3>;  // du, dv in px, growth of the radius
using Matrix = std::array<Move, 3>;

inline double dot3(const Move& a, const Move& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// The inverse of a symmetric matrix; none where there is none.
inline std::optional<Matrix> inverse(const Matrix& m) {
  const double a = m[1][1] * m[2][2] - m[1][2] * m[1][2];
  const double b = m[0][2] * m[1][2] - m[0][1] * m[2][2];
  const double c = m[0][1] * m[1][2] - m[0][2] * m[1][1];
  const double det = m[0][0] * a + m[0][1] * b + m[0][2] * c;
  if (!(det > 0.0)) {
    return std::nullopt;
  }
  const double d = m[0][0] * m[2][2] - m[0][2] * m[0][2];
  const double e = m[0][1] * m[0][2] - m[0][0] * m[1][2];
  const double f = m[0][0] * m[1][1] - m[0][1] * m[0][1];
  return Matrix{{{a / det, b / det, c / det}, {b / det, d / det, e / det}, {c / det, e / det, f / det}}};
}

}  // namespace vision
