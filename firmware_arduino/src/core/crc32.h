// CRC-32 (IEEE 802.3, as zlib.crc32), bit by bit: it runs rarely and a table would cost a kilobyte.
#ifndef HIL_CORE_CRC32_H
#define HIL_CORE_CRC32_H

#include <stdint.h>

namespace hil {

// Continues `crc` (start with 0) over n bytes.
uint32_t crc32(uint32_t crc, const void* data, uint16_t n);

// The register of the CRC (start with ~0, the CRC is its complement) after a byte, for tables that the
// compiler works out.
constexpr uint32_t crc32_shift(uint32_t state, uint8_t bits) {
  return bits == 0 ? state
                   : crc32_shift((state >> 1) ^ ((state & 1u) != 0 ? 0xEDB88320u : 0u),
                                 static_cast<uint8_t>(bits - 1));
}
constexpr uint32_t crc32_byte(uint32_t state, uint8_t byte) { return crc32_shift(state ^ byte, 8); }

}  // namespace hil

#endif
