// Time and the fixed-rate tick, both from timer 5.
#pragma once

#include <stdint.h>

namespace hil {
namespace ticker {

void start();

// Ticks since start (wraps); the main loop runs one control tick for every change.
uint8_t count();

// Board time in microseconds since start; wraps as a uint32. Callable with interrupts on or off.
uint32_t now_us();

}  // namespace ticker
}  // namespace hil
