// Four robots side by side, for processors with AVX2 (CMakeLists.txt compiles this file alone for them).
#ifdef __AVX2__
#include <immintrin.h>
#define TWIN_ROOT(v) _mm256_sqrt_pd(v)
#define TWIN_LANES 4
#define TWIN_RUN run_four
#define TWIN_DIRECT direct_four
#include "lane_run.hpp"
#endif
