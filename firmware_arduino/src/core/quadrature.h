// x4 decoding of a two-phase encoder with the transition table of the thesis (section 8.10.3).
#ifndef HIL_CORE_QUADRATURE_H
#define HIL_CORE_QUADRATURE_H

#include <stdint.h>

namespace hil {

constexpr int8_t QUADRATURE_ILLEGAL = 2;  // both phases changed at once: an edge was missed

// Counts for a transition, by (last_ab << 2) | ab, ab = (A << 1) | B. The thesis counts up on 1101,
// 0100, 0010, 1011 and down on 1110, 0111, 0001, 1000; where neither phase changed, nothing.
extern const int8_t QUADRATURE_STEP[16];

// The transition alone, for an interrupt handler that keeps its own narrow count; both arguments 0..3.
inline int8_t quadrature_step(uint8_t last_ab, uint8_t ab) {
  return QUADRATURE_STEP[static_cast<uint8_t>(last_ab << 2) | ab];
}

struct Quadrature {
  uint8_t last_ab;   // (A << 1) | B at the last update
  int32_t counts;    // rises when the wheel drives forward
  uint16_t illegal;  // transitions without a direction; wraps
};

// Takes the pins as they are now, ab = (A << 1) | B. Called on every edge of either phase.
void quadrature_update(Quadrature& q, uint8_t ab);

}  // namespace hil

#endif
