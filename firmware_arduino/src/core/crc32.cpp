#include "crc32.h"

namespace hil {

uint32_t crc32(uint32_t crc, const void* data, uint16_t n) {
  const uint8_t* bytes = static_cast<const uint8_t*>(data);
  crc = ~crc;
  for (uint16_t i = 0; i < n; ++i) {
    crc ^= bytes[i];
    for (uint8_t bit = 0; bit < 8; ++bit) {
      crc = (crc >> 1) ^ ((crc & 1u) ? 0xEDB88320u : 0u);
    }
  }
  return ~crc;
}

}  // namespace hil
