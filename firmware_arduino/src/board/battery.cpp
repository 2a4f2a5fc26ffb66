#include "battery.h"

#include <avr/io.h>

#include "pins.h"

namespace hil {
namespace battery {
namespace {

uint16_t g_mv;

}  // namespace

void start() {
  DIDR0 |= _BV(pins::kBatteryAdc);         // no digital input on an analog pin
  ADMUX = _BV(REFS0) | pins::kBatteryAdc;  // against the 5 V supply
  ADCSRB = 0;
  ADCSRA = _BV(ADEN) | _BV(ADSC) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);  // clk/128 = 125 kHz
}

uint16_t read_mv() {
  if (!(ADCSRA & _BV(ADSC))) {
    g_mv = (ADC * pins::kBatteryFullScale_mv) >> 10;
    ADCSRA |= _BV(ADSC);
  }
  return g_mv;
}

}  // namespace battery
}  // namespace hil
