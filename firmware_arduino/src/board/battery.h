// Battery voltage through a divider on the converter; never waits.
#pragma once

#include <stdint.h>

namespace hil {
namespace battery {

void start();

// Last finished conversion in millivolts of the battery; starts the next one. Zero before the first.
uint16_t read_mv();

}  // namespace battery
}  // namespace hil
