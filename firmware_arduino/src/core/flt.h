// Small float operations in the form that soft float does cheapest: a comparison costs the AVR about
// 70 cycles, a look at the bits of a float a few.
#ifndef HIL_CORE_FLT_H
#define HIL_CORE_FLT_H

#include <math.h>
#include <stdint.h>
#include <string.h>

namespace hil {

inline bool is_zero(float x) {
  uint32_t bits;
  memcpy(&bits, &x, 4);
  return (bits << 1) == 0;  // either zero
}

// size * sgn(x), for size >= 0; sgn(0) is 0
inline float with_sign(float size, float x) { return is_zero(x) ? 0.0f : copysignf(size, x); }

inline float clamp(float x, float limit) {
  if (x > limit) return limit;
  return x < -limit ? -limit : x;
}

}  // namespace hil

#endif
