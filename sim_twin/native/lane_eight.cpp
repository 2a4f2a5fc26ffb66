// Eight robots side by side, for processors with AVX-512 (CMakeLists.txt compiles this file alone for them).
#ifdef __AVX512F__
#include <immintrin.h>
#define TWIN_ROOT(v) _mm512_sqrt_pd(v)
#define TWIN_LANES 8
#define TWIN_RUN run_eight
#include "lane_run.hpp"
#endif
