// Byte ring to the serial port. Frames go in whole or not at all.
#ifndef HIL_CORE_RING_H
#define HIL_CORE_RING_H

#include <stdint.h>

namespace hil {

// 256 bytes, so that the indices wrap by themselves; it holds up to 255.
struct Ring {
  uint8_t bytes[256];
  uint8_t head;   // next to write
  uint8_t tail;   // next to read
  uint8_t ready;  // end of what may be read: behind it a frame waits for its signature
};

inline uint8_t ring_used(const Ring& r) { return static_cast<uint8_t>(r.head - r.tail); }

inline uint8_t ring_free(const Ring& r) { return static_cast<uint8_t>(255u - ring_used(r)); }

// The caller has made sure of the room.
inline void ring_put(Ring& r, const uint8_t* data, uint8_t n) {
  for (uint8_t i = 0; i < n; ++i) r.bytes[r.head++] = data[i];
}

inline uint16_t ring_take(Ring& r, uint8_t* out, uint16_t max) {
  uint16_t n = 0;
  while (n < max && r.tail != r.ready) out[n++] = r.bytes[r.tail++];
  return n;
}

}  // namespace hil

#endif
