// Every pin of the robot, in one place; docs/wiring.md has the drawing. Arduino numbers stand
// beside the port bits; code uses the port bits (one instruction each).
//
// Encoders hang on the processor's external interrupts INT0, INT1 (left) and INT4, INT5 (right).
// These are the ATmega2560's own numbers, not those of Arduino's attachInterrupt(), whose 4 and 5
// are pins 19 and 18: the UART that the Bluetooth module needs.
#pragma once

#include <avr/io.h>
#include <stdint.h>

namespace hil {
namespace pins {

// Port D. B on bit 0 and A on bit 1, so that the two bits read as (A << 1) | B at once.
// A leads B when the wheel turns forward.
constexpr uint8_t kLeftEncoderB = PD0;  // pin 21, INT0
constexpr uint8_t kLeftEncoderA = PD1;  // pin 20, INT1
constexpr uint8_t kBluetoothRx = PD2;   // pin 19, RXD1, from the module's TXD

// Port E. Bits 0 and 1 are RXD0 and TXD0 of the USB bridge.
constexpr uint8_t kRightEncoderB = PE4;  // pin 2, INT4
constexpr uint8_t kRightEncoderA = PE5;  // pin 3, INT5

// Port H, timer 4: left half of the bridge. IN1 chops forward, IN2 backward.
constexpr uint8_t kLeftIn1 = PH3;  // pin 6, OC4A
constexpr uint8_t kLeftIn2 = PH4;  // pin 7, OC4B

// Port B, timer 1: right half of the bridge, and the board's own LED, lit while armed.
constexpr uint8_t kRightIn3 = PB5;  // pin 11, OC1A
constexpr uint8_t kRightIn4 = PB6;  // pin 12, OC1B
constexpr uint8_t kLed = PB7;       // pin 13

// Port A: the bridge's enable inputs, pulled down on its board.
constexpr uint8_t kLeftEnable = PA0;   // pin 22, ENA
constexpr uint8_t kRightEnable = PA1;  // pin 23, ENB

// Port F: battery through 20 kOhm over 10 kOhm, so that 15 V reads as 5 V.
constexpr uint8_t kBatteryAdc = 0;  // pin A0, ADC0
constexpr uint32_t kBatteryFullScale_mv = 15000;

}  // namespace pins
}  // namespace hil
