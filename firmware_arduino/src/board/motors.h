// The H-bridge: four hardware PWM outputs at 20 kHz, one pair a side; and the lamp that says armed.
#pragma once

#include <stdint.h>

namespace hil {
namespace motors {

// Outputs low, timers running, bridge enabled: both sides braked.
void start();

// Duty of both sides in counts of -PWM_TOP..PWM_TOP; positive turns the wheel forward.
void write(int16_t left, int16_t right);

void show_armed(bool armed);

}  // namespace motors
}  // namespace hil
