// Eight robots side by side, for processors with AVX-512 (CMakeLists.txt compiles this file alone for them).
#ifdef __AVX512F__
#include <immintrin.h>

#include <cstdint>

namespace {

// What is left of the exponent of v when the value is taken down by `by` powers of two; for a power of two itself
// one less, as the numbers below it lie closer together.
[[gnu::always_inline]] inline __m512d scale(__m512d v, long long by) {
  const __m512i taken = _mm512_sub_epi64(_mm512_castpd_si512(v), _mm512_set1_epi64((by << 52) + 1));
  return _mm512_castsi512_pd(_mm512_and_si512(taken, _mm512_set1_epi64(0x7ff0000000000000LL)));
}

// v / sqrt(x), root and quotient each rounded to nearest as by the processor's own instructions, in half of their
// time: by Newton's iteration, and then proven. With fused operations the remainders x - s s and v - q s are
// exact; a root or quotient is the nearest number where its remainder is less than half a unit of its last place
// makes it. Returns whether it is proven for all eight: not for numbers so small that remainders round.
[[gnu::always_inline]] inline bool proven_over_root(__m512d v, __m512d x, __m512d& out) {
  const __m512d half = _mm512_set1_pd(0.5);
  const __m512d guess = _mm512_rsqrt14_pd(x);
  __m512d g = _mm512_mul_pd(x, guess), h = _mm512_mul_pd(half, guess);  // to sqrt(x), 0.5 / sqrt(x)
  for (int i = 0; i < 2; ++i) {
    const __m512d r = _mm512_fnmadd_pd(g, h, half);
    g = _mm512_fmadd_pd(g, r, g);
    h = _mm512_fmadd_pd(h, r, h);
  }
  const __m512d s = _mm512_fmadd_pd(_mm512_fnmadd_pd(g, g, x), h, g);
  const __m512d per_s = _mm512_add_pd(h, h);
  const __m512d first = _mm512_mul_pd(v, per_s);
  const __m512d q = _mm512_fmadd_pd(_mm512_fnmadd_pd(first, s, v), per_s, first);

  const __m512d root_left = _mm512_abs_pd(_mm512_fnmadd_pd(s, s, x));
  const __m512d left = _mm512_abs_pd(_mm512_fnmadd_pd(q, s, v));
  __mmask8 sure = _mm512_cmp_pd_mask(root_left, _mm512_mul_pd(s, scale(s, 52)), _CMP_LT_OQ);
  sure = _mm512_mask_cmp_pd_mask(sure, left, _mm512_mul_pd(s, scale(q, 53)), _CMP_LT_OQ);
  sure = _mm512_mask_cmp_pd_mask(sure, x, _mm512_set1_pd(0x1p-800), _CMP_GE_OQ);
  // |v| >= 2^-400, or 0, which taking one away makes the largest of all
  const __m512i size = _mm512_and_si512(_mm512_castpd_si512(v), _mm512_set1_epi64(0x7fffffffffffffffLL));
  sure = _mm512_mask_cmp_epu64_mask(sure, _mm512_sub_epi64(size, _mm512_set1_epi64(1)),
                                    _mm512_castpd_si512(_mm512_set1_pd(0x1p-400)), _MM_CMPINT_NLT);
  // The sign of -0 has been lost on the way.
  const __m512i sign = _mm512_and_si512(_mm512_castpd_si512(v), _mm512_set1_epi64(INT64_MIN));
  out = _mm512_castsi512_pd(_mm512_or_si512(_mm512_castpd_si512(q), sign));
  return sure == 0xff;
}

}  // namespace

#define TWIN_ROOT(v) _mm512_sqrt_pd(v)
#define TWIN_LANES 8
#define TWIN_RUN run_eight
#define TWIN_DIRECT direct_eight
#include "lane_run.hpp"
#endif
