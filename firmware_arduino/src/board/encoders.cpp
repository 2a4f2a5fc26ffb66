#include "encoders.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>
#include <util/delay.h>

#include "../core/quadrature.h"
#include "pins.h"

namespace hil {
namespace encoders {
namespace {

// One byte each, so that a handler stays below 100 cycles; read() unwraps them.
struct Wheel {
  volatile uint8_t last_ab;
  volatile int8_t tally;
  volatile uint8_t illegal;
};

Wheel g_left, g_right;
Counts g_counts;
uint8_t g_left_read, g_right_read;        // tallies at the last read
uint8_t g_left_illegal, g_right_illegal;  // the same for illegal transitions

static_assert(pins::kLeftEncoderB == 0 && pins::kLeftEncoderA == 1, "left_ab() takes bits 0, 1");
static_assert(pins::kRightEncoderB == 4 && pins::kRightEncoderA == 5, "right_ab() takes bits 4, 5");

inline uint8_t left_ab() { return PIND & 3; }

inline uint8_t right_ab() {
  return __builtin_avr_swap(PINE) & 3;  // a shift by four is a loop here
}

inline void on_edge(Wheel& wheel, uint8_t ab) {
  const int8_t step = quadrature_step(wheel.last_ab, ab);
  wheel.last_ab = ab;
  if (step == QUADRATURE_ILLEGAL) {
    ++wheel.illegal;
  } else {
    wheel.tally += step;
  }
}

}  // namespace

void start() {
  // Pull-ups suit open-collector encoders and do no harm to driven ones.
  PORTD |= _BV(pins::kLeftEncoderA) | _BV(pins::kLeftEncoderB);
  PORTE |= _BV(pins::kRightEncoderA) | _BV(pins::kRightEncoderB);
  _delay_us(10);                    // for the pull-ups to charge the leads before the first look
  EICRA = _BV(ISC00) | _BV(ISC10);  // any edge
  EICRB = _BV(ISC40) | _BV(ISC50);
  g_left.last_ab = left_ab();
  g_right.last_ab = right_ab();
  EIFR = _BV(INTF0) | _BV(INTF1) | _BV(INTF4) | _BV(INTF5);
  EIMSK = _BV(INT0) | _BV(INT1) | _BV(INT4) | _BV(INT5);
}

Counts read() {
  uint8_t left, right, left_illegal, right_illegal;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    left = g_left.tally;
    right = g_right.tally;
    left_illegal = g_left.illegal;
    right_illegal = g_right.illegal;
  }
  g_counts.left += static_cast<int8_t>(left - g_left_read);
  g_counts.right += static_cast<int8_t>(right - g_right_read);
  g_counts.illegal += static_cast<uint8_t>(left_illegal - g_left_illegal);
  g_counts.illegal += static_cast<uint8_t>(right_illegal - g_right_illegal);
  g_left_read = left;
  g_right_read = right;
  g_left_illegal = left_illegal;
  g_right_illegal = right_illegal;
  return g_counts;
}

ISR(INT0_vect) { on_edge(g_left, left_ab()); }
ISR(INT1_vect, ISR_ALIASOF(INT0_vect));
ISR(INT4_vect) { on_edge(g_right, right_ab()); }
ISR(INT5_vect, ISR_ALIASOF(INT4_vect));

}  // namespace encoders
}  // namespace hil
