// Small dense matrices in the roundings of the BLAS and LAPACK kernels of a processor with fused multiply-add
// (OpenBLAS, as numpy calls it there): on every processor the same digits.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace vision {

template <std::size_t Rows, std::size_t Columns>
using Dense = std::array<std::array<double, Columns>, Rows>;

// Row by column, one multiply-add after the other.
template <std::size_t M, std::size_t K, std::size_t N>
Dense<M, N> product(const Dense<M, K>& a, const Dense<K, N>& b) {
  Dense<M, N> out{};
  for (std::size_t i = 0; i < M; ++i) {
    for (std::size_t j = 0; j < N; ++j) {
      for (std::size_t k = 0; k < K; ++k) {
        out[i][j] = std::fma(a[i][k], b[k][j], out[i][j]);
      }
    }
  }
  return out;
}

// A matrix applied to a column of two or three: the second term is the first.
template <std::size_t M, std::size_t N>
std::array<double, M> applied(const Dense<M, N>& a, const std::array<double, N>& x) {
  static_assert(N == 2 || N == 3, "longer sums have another order");
  std::array<double, M> out;
  for (std::size_t i = 0; i < M; ++i) {
    out[i] = std::fma(a[i][0], x[0], a[i][1] * x[1]);
    if constexpr (N == 3) {
      out[i] = std::fma(a[i][2], x[2], out[i]);
    }
  }
  return out;
}

template <std::size_t M, std::size_t N>
Dense<N, M> transposed(const Dense<M, N>& a) {
  Dense<N, M> out;
  for (std::size_t i = 0; i < M; ++i) {
    for (std::size_t j = 0; j < N; ++j) {
      out[j][i] = a[i][j];
    }
  }
  return out;
}

// The inverse of a matrix of two or three rows: LU with row exchanges, then the unit matrix solved for, its first
// two rows and the third in blocks of their own. Infinite or NaN where there is none.
template <std::size_t N>
Dense<N, N> inverse_of(Dense<N, N> lu) {
  static_assert(N == 2 || N == 3, "blocks of larger ones are others");
  std::array<std::size_t, N> order;
  for (std::size_t i = 0; i < N; ++i) {
    order[i] = i;
  }
  for (std::size_t j = 0; j < N; ++j) {
    for (std::size_t i = 1; i < N; ++i) {
      double sum = 0.0;
      for (std::size_t k = 0; k < std::min(i, j); ++k) {
        sum = std::fma(lu[i][k], lu[k][j], sum);
      }
      lu[i][j] -= sum;
    }
    std::size_t pivot = j;
    for (std::size_t i = j + 1; i < N; ++i) {
      pivot = std::abs(lu[i][j]) > std::abs(lu[pivot][j]) ? i : pivot;
    }
    std::swap(lu[j], lu[pivot]);
    std::swap(order[j], order[pivot]);
    const double scale = 1.0 / lu[j][j];
    for (std::size_t i = j + 1; i < N; ++i) {
      lu[i][j] *= scale;
    }
  }
  Dense<N, N> out;
  for (std::size_t column = 0; column < N; ++column) {
    std::array<double, N> x;
    for (std::size_t i = 0; i < N; ++i) {
      x[i] = order[i] == column ? 1.0 : 0.0;
    }
    x[1] = std::fma(-x[0], lu[1][0], x[1]);
    if constexpr (N == 3) {
      x[2] -= std::fma(lu[2][1], x[1], lu[2][0] * x[0]);
      x[2] *= 1.0 / lu[2][2];
      x[0] -= lu[0][2] * x[2];
      x[1] -= lu[1][2] * x[2];
    }
    x[1] *= 1.0 / lu[1][1];
    x[0] = std::fma(-x[1], lu[0][1], x[0]);
    x[0] *= 1.0 / lu[0][0];
    for (std::size_t i = 0; i < N; ++i) {
      out[i][column] = x[i];
    }
  }
  return out;
}

}  // namespace vision
