// Data-space addresses of the ATmega2560 (datasheet, register summary) and the robot's wiring
// (firmware_arduino/src/board/pins.h), as the simulated robot meets them.
#pragma once

#include <cstdint>

namespace pil {

using Address = std::uint16_t;

constexpr double kClock_mhz = 16.0;
constexpr Address kRamStart = 0x200, kRamEnd = 0x21FF;
constexpr Address kSMCR = 0x53, kMCUSR = 0x54;
constexpr std::uint8_t kPowerOnReset = 1, kExternalReset = 2, kSleepEnableIdle = 1;
constexpr std::uint8_t kSleepModeMask = 0x0F;
constexpr int kVectors = 57;
constexpr int kVectorInt0 = 1, kVectorInt1 = 2, kVectorInt4 = 5, kVectorInt5 = 6;

// Encoder pins of a side: port letter, PINx, and the bits of A and B.
struct EncoderPins {
  char port;
  Address pin;
  int bit_a, bit_b;
};
constexpr EncoderPins kEncoder[2] = {{'D', 0x29, 1, 0}, {'E', 0x2C, 5, 4}};

// Half of the bridge: one timer drives IN forward (channel A) and IN backward (channel B).
struct BridgeHalf {
  Address tccra, tccrb, icr, ocra, ocrb;  // low bytes of the 16-bit ones
  Address ddr;
  std::uint8_t forward_bit, backward_bit;
  std::uint8_t enable_bit;  // in port A
};
constexpr Address kDDRA = 0x21, kPORTA = 0x22;
constexpr BridgeHalf kBridge[2] = {
    {0xA0, 0xA1, 0xA6, 0xA8, 0xAA, 0x101, 1 << 3, 1 << 4, 1 << 0},  // timer 4, port H
    {0x80, 0x81, 0x86, 0x88, 0x8A, 0x24, 1 << 5, 1 << 6, 1 << 1},   // timer 1, port B
};
// Phase-correct PWM with ICRn as top, both channels non-inverting, clock running at any rate.
constexpr std::uint8_t kPwmModeA = 0xA2, kPwmModeB = 0x10, kPwmModeBMask = 0x18, kClockMask = 0x07;
// Modes that have ICRn as top: WGMn3 set, WGMn0 clear.
constexpr std::uint8_t kTopModeB = 0x10, kTopNotA = 0x01;

struct UartRegisters {
  Address ucsra, ubrrl, ubrrh;
};
constexpr UartRegisters uart_registers(char name) {
  return name == '0' ? UartRegisters{0xC0, 0xC4, 0xC5} : UartRegisters{0xC8, 0xCC, 0xCD};
}

}  // namespace pil
