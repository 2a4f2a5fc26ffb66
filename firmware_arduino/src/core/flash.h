// Constant tables that stay in flash on the AVR, where a plain const table would be copied to RAM.
#ifndef HIL_CORE_FLASH_H
#define HIL_CORE_FLASH_H

#include <string.h>

#ifdef __AVR__
#include <avr/pgmspace.h>
#define HIL_FLASH PROGMEM
#define HIL_FLASH_COPY(to, from, n) memcpy_P((to), (from), (n))
#define HIL_FLASH_STRNCMP(text, entry, n) strncmp_P((text), (entry), (n))
#else
#define HIL_FLASH
#define HIL_FLASH_COPY(to, from, n) memcpy((to), (from), (n))
#define HIL_FLASH_STRNCMP(text, entry, n) strncmp((text), (entry), (n))
#endif

namespace hil {

// Returns a copy of one table entry.
template <typename T>
T flash_read(const T& entry) {
  T copy;
  HIL_FLASH_COPY(&copy, &entry, sizeof(T));
  return copy;
}

}  // namespace hil

#endif
