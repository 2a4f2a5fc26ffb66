#include "ticker.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "../core/board.h"

namespace hil {
namespace ticker {
namespace {

// Timer 5 counts half microseconds (clk/8) and clears at the tick, so its count is the time
// within the tick and no second timer is needed to tell the time.
constexpr uint16_t kCountsPerTick = F_CPU / 8 / (1000000UL / TICK_US);
static_assert(F_CPU / 8 == 2000000UL, "now_us() takes two counts for a microsecond");

volatile uint8_t g_ticks;
volatile uint32_t g_tick_us;  // time at the last tick

}  // namespace

void start() {
  TCCR5A = 0;
  OCR5A = kCountsPerTick - 1;
  TCCR5B = _BV(WGM52) | _BV(CS51);
  TIMSK5 = _BV(OCIE5A);
}

uint8_t count() { return g_ticks; }

uint32_t now_us() {
  uint32_t t_us;
  uint16_t counts;
  bool wrapped;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    counts = TCNT5;
    wrapped = TIFR5 & _BV(OCF5A);
    t_us = g_tick_us;
  }
  // The timer may have cleared with its interrupt still waiting; a count read before that is high.
  if (wrapped && counts < kCountsPerTick / 2) t_us += TICK_US;
  return t_us + counts / 2;
}

ISR(TIMER5_COMPA_vect) {
  ++g_ticks;
  g_tick_us += TICK_US;
}

}  // namespace ticker
}  // namespace hil
