// CRC-32 (IEEE 802.3, as zlib.crc32), bit by bit: it runs rarely and a table would cost a kilobyte.
#ifndef HIL_CORE_CRC32_H
#define HIL_CORE_CRC32_H

#include <stdint.h>

namespace hil {

// Continues `crc` (start with 0) over n bytes.
uint32_t crc32(uint32_t crc, const void* data, uint16_t n);

}  // namespace hil

#endif
