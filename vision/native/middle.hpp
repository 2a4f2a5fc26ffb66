// The value in the middle of 48: as std::nth_element finds it, by a network of exchanges without a branch.
#pragma once

#include <array>
#include <cstddef>
#include <utility>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace vision {

// Numbers worked on two at a time; compilers that know GCC's vectors bring the operators.
using Two = double __attribute__((vector_size(16)));

#ifdef __SSE2__
inline Two least(Two a, Two b) { return _mm_min_pd(a, b); }
inline Two most(Two a, Two b) { return _mm_max_pd(a, b); }
#else
inline Two least(Two a, Two b) { return a < b ? a : b; }
inline Two most(Two a, Two b) { return a < b ? b : a; }
#endif

namespace sorting {

constexpr std::size_t kCount = 24;

struct Exchange {
  std::size_t low, high;
};

// Batcher's odd-even merge sort, written out; calls take(low, high) for each exchange.
template <typename Take>
constexpr void exchanges(Take take) {
  for (std::size_t p = 1; p < kCount; p *= 2) {
    for (std::size_t k = p; k >= 1; k /= 2) {
      for (std::size_t j = k % p; j + k < kCount; j += 2 * k) {
        for (std::size_t i = 0; i < k && i + j + k < kCount; ++i) {
          if ((i + j) / (2 * p) == (i + j + k) / (2 * p)) {
            take(i + j, i + j + k);
          }
        }
      }
    }
  }
}

constexpr std::size_t count() {
  std::size_t found = 0;
  exchanges([&found](std::size_t, std::size_t) { ++found; });
  return found;
}

constexpr std::array<Exchange, count()> network() {
  std::array<Exchange, count()> found{};
  std::size_t at = 0;
  exchanges([&](std::size_t low, std::size_t high) {
    found[at].low = low;
    found[at].high = high;
    ++at;
  });
  return found;
}

inline constexpr std::array<Exchange, count()> kNetwork = network();

inline void exchange(Two& low, Two& high) {
  const Two less = least(low, high);
  high = most(low, high);
  low = less;
}

template <std::size_t... At>
void sorted(std::array<Two, kCount>& columns, std::index_sequence<At...>) {
  (exchange(columns[kNetwork[At].low], columns[kNetwork[At].high]), ...);
}

}  // namespace sorting

// The 25th of 48 values by size, none of which is NaN.
inline double middle(const std::array<double, 48>& values) {
  using sorting::kCount;
  std::array<Two, kCount> columns;
  for (std::size_t i = 0; i < kCount; ++i) {
    columns[i] = Two{values[i], values[i + kCount]};
  }
  sorting::sorted(columns, std::make_index_sequence<sorting::kNetwork.size()>{});
  // Of two halves in order: the least, over all ways to take 25, of the most that is taken.
  double found = columns[0][0] < columns[kCount - 1][1] ? columns[kCount - 1][1] : columns[0][0];
  for (std::size_t i = 1; i < kCount; ++i) {
    const double left = columns[i][0];
    const double right = columns[kCount - 1 - i][1];
    const double taken = left < right ? right : left;
    found = taken < found ? taken : found;
  }
  return found;
}

}  // namespace vision
