// Facts of the board that both the core and the host's tools rely on.
#ifndef HIL_CORE_CONSTANTS_H
#define HIL_CORE_CONSTANTS_H

#include <stdint.h>

namespace hil {

constexpr int16_t PWM_TOP = 400;    // 20 kHz phase-correct PWM from a 16 MHz timer
constexpr uint16_t TICK_US = 4000;  // 250 Hz
constexpr float TICK_S = 0.004f;
// The encoder interrupt tallies a tick's counts in one byte: 127 of them at most.
constexpr float ENCODER_COUNTS_1_S = 127.0f / TICK_S;
constexpr uint8_t BOARD_SYSTEM_ID = 1;
constexpr uint8_t BOARD_COMPONENT_ID = 1;
constexpr uint8_t LEFT = 0;
constexpr uint8_t RIGHT = 1;
constexpr uint8_t SIDES = 2;

}  // namespace hil

#endif
