// Two quadrature encoders, four counts a period, on external interrupts.
#pragma once

#include <stdint.h>

namespace hil {
namespace encoders {

struct Counts {
  int32_t left, right;  // rise when the wheel turns forward
  uint16_t illegal;     // transitions of both channels at once, both encoders together
};

void start();

// Counts up to now; call at least every 15 ms at 8,000 edges a second.
Counts read();

}  // namespace encoders
}  // namespace hil
