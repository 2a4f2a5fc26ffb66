// Eight robots side by side, for processors with AVX-512 (CMakeLists.txt compiles this file alone for them).
#ifdef __AVX512F__
#include <immintrin.h>

namespace {

// What is left of the exponent of v when the value is taken down by `by` powers of two; for a power of two itself
// one less, as the numbers below it lie closer together.
[[gnu::always_inline]] inline __m512d scale(__m512d v, long long by) {
  const __m512i taken = _mm512_sub_epi64(_mm512_castpd_si512(v), _mm512_set1_epi64((by << 52) + 1));
  return _mm512_castsi512_pd(_mm512_and_si512(taken, _mm512_set1_epi64(0x7ff0000000000000LL)));
}

// sqrt(x) rounded to nearest as by the processor's own instruction, without the divider, which a step waits for
// most: by Newton's iteration, and then proven. With a fused operation the remainder x - s s is exact; s is the
// nearest number where the remainder is less than half a unit of its last place makes it. Returns whether it is
// proven for all eight: not for numbers so small that remainders round.
[[gnu::always_inline]] inline bool proven_root(__m512d x, __m512d& out) {
  const __m512d half = _mm512_set1_pd(0.5);
  const __m512d guess = _mm512_rsqrt14_pd(x);
  __m512d g = _mm512_mul_pd(x, guess), h = _mm512_mul_pd(half, guess);  // to sqrt(x), 0.5 / sqrt(x)
  // 1 / sqrt(1 - 2 r) = 1 + r + 3/2 r^2 + ..: from 14 bits to 40
  const __m512d r = _mm512_fnmadd_pd(g, h, half);
  const __m512d more = _mm512_fmadd_pd(_mm512_mul_pd(r, _mm512_set1_pd(1.5)), r, r);
  g = _mm512_fmadd_pd(g, more, g);
  h = _mm512_fmadd_pd(h, more, h);
  out = _mm512_fmadd_pd(_mm512_fnmadd_pd(g, g, x), h, g);
  const __m512d left = _mm512_abs_pd(_mm512_fnmadd_pd(out, out, x));
  const __mmask8 sure = _mm512_cmp_pd_mask(left, _mm512_mul_pd(out, scale(out, 52)), _CMP_LT_OQ);
  return _mm512_mask_cmp_pd_mask(sure, x, _mm512_set1_pd(0x1p-800), _CMP_GE_OQ) == 0xff;
}

}  // namespace

#define TWIN_ROOT(v) _mm512_sqrt_pd(v)
#define TWIN_PROVEN_ROOT proven_root
#define TWIN_LANES 8
#define TWIN_RUN run_eight
#define TWIN_DIRECT direct_eight
#include "lane_run.hpp"
#endif
