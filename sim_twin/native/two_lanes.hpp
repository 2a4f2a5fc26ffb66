// Two numbers worked on at once, left and right or front and rear: half the instructions of one by
// one, and one formula in place of two. Compilers that know GCC's vectors bring the operators.
#pragma once

#include <cmath>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace twin {

using Pair = double __attribute__((vector_size(16)));

inline Pair root(Pair a) {
#ifdef __SSE2__
  return _mm_sqrt_pd(a);
#else
  return Pair{std::sqrt(a[0]), std::sqrt(a[1])};
#endif
}

inline Pair magnitude(Pair a) { return Pair{std::fabs(a[0]), std::fabs(a[1])}; }

inline double sum(Pair a) { return a[0] + a[1]; }

}  // namespace twin
