#include "motors.h"

#include <avr/io.h>

#include "../core/board.h"
#include "pins.h"

namespace hil {
namespace motors {
namespace {

static_assert(F_CPU / (2UL * PWM_TOP) == 20000UL, "PWM_TOP sets 20 kHz, above hearing");

// Phase-correct PWM with ICRn as top (mode 10): an output compare of 0 is steadily low and one of
// top steadily high, and both outputs of a timer take a new value at the same instant.
constexpr uint8_t kModeA = _BV(COM4A1) | _BV(COM4B1) | _BV(WGM41);
constexpr uint8_t kModeB = _BV(WGM43);
constexpr uint8_t kClock = _BV(CS40);

int16_t positive(int16_t duty) { return duty > 0 ? duty : 0; }

}  // namespace

void start() {
  // Stopped and in the normal mode, which Arduino's start left: compare values are taken at once. ICRn can
  // be written in a mode only that uses it as its top, so the mode comes first and the clock last.
  TCCR4B = TCCR1B = 0;
  TCCR4A = TCCR1A = 0;
  OCR4A = OCR4B = OCR1A = OCR1B = 0;
  TCNT4 = TCNT1 = 0;
  TCCR4A = TCCR1A = kModeA;  // the bits have the same places in both timers
  TCCR4B = TCCR1B = kModeB;
  ICR4 = ICR1 = PWM_TOP;
  TCCR4B = TCCR1B = kModeB | kClock;
  DDRH |= _BV(pins::kLeftIn1) | _BV(pins::kLeftIn2);
  DDRB |= _BV(pins::kRightIn3) | _BV(pins::kRightIn4) | _BV(pins::kLed);
  // Enabled for good: with both inputs of a side low the bridge shorts the motor, so the wheel is
  // braked at zero duty and in the off time of a period, and the mean voltage is duty * battery.
  PORTA |= _BV(pins::kLeftEnable) | _BV(pins::kRightEnable);
  DDRA |= _BV(pins::kLeftEnable) | _BV(pins::kRightEnable);
}

void show_armed(bool armed) {
  if (armed) {
    PORTB |= _BV(pins::kLed);
  } else {
    PORTB &= ~_BV(pins::kLed);
  }
}

void write(int16_t left, int16_t right) {
  OCR4A = positive(left);
  OCR4B = positive(-left);
  OCR1A = positive(right);
  OCR1B = positive(-right);
}

}  // namespace motors
}  // namespace hil
