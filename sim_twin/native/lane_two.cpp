// Two robots side by side, in the registers that every processor has.
#ifdef __SSE2__
#include <emmintrin.h>
#define TWIN_ROOT(v) _mm_sqrt_pd(v)
#else
#define TWIN_ROOT(v) \
  V { std::sqrt(v[0]), std::sqrt(v[1]) }
#endif
#define TWIN_LANES 2
#define TWIN_RUN run_two
#define TWIN_DIRECT direct_two
#include "lane_run.hpp"
