#include "uart.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "pins.h"

namespace hil {
namespace uart {
namespace {

// The receive ring holds what arrives during the longest pass of the main loop: at 57,600 baud a
// tick of 4 ms lets 23 bytes in. The transmit ring only bridges two passes; the core has its own.
constexpr uint8_t kReceiveSize = 128;
constexpr uint8_t kTransmitSize = 64;

// Ring sizes are powers of two: a mask wraps an index in one instruction, `%` would call a division.
inline uint8_t in_receive(uint8_t index) { return index & (kReceiveSize - 1); }
inline uint8_t in_transmit(uint8_t index) { return index & (kTransmitSize - 1); }

struct Channel {
  volatile uint8_t rx_head, rx_tail, tx_head, tx_tail;  // heads are written to, tails taken from
  uint8_t rx[kReceiveSize];
  uint8_t tx[kTransmitSize];
};

Channel g_channels[kPorts];

// The bytes of a ring are not volatile: what was done to them is done before an index gives them away.
inline void finish_bytes() { __asm__ volatile("" ::: "memory"); }

// Handlers are inlined by force: a call would have them save every register a function may use.
#define HIL_IN_HANDLER inline __attribute__((always_inline))

// A byte that is lost, here or by an overrun in the hardware, costs its frame the checksum, and that
// is counted.
HIL_IN_HANDLER void on_received(Channel& channel, uint8_t status, uint8_t byte) {
  const uint8_t head = channel.rx_head;
  const uint8_t next = in_receive(head + 1);
  if ((status & _BV(FE0)) || next == channel.rx_tail) return;
  channel.rx[head] = byte;
  channel.rx_head = next;
}

// Returns true when there is nothing left to send and the interrupt can rest.
HIL_IN_HANDLER bool on_empty(Channel& channel, volatile uint8_t& data) {
  const uint8_t tail = channel.tx_tail;
  if (tail == channel.tx_head) return true;
  data = channel.tx[tail];
  channel.tx_tail = in_transmit(tail + 1);
  return false;
}

constexpr uint16_t kDivider = (F_CPU / 4 / kBaud - 1) / 2;  // double speed, rounded
constexpr uint8_t kEnable = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
constexpr uint8_t kFrame8N1 = _BV(UCSZ01) | _BV(UCSZ00);

}  // namespace

void start() {
  // A line with nothing plugged in must idle high, or noise would read as bytes.
  PORTD |= _BV(pins::kBluetoothRx);
  UCSR0A = UCSR1A = _BV(U2X0);
  UBRR0 = UBRR1 = kDivider;
  UCSR0C = UCSR1C = kFrame8N1;
  UCSR0B = UCSR1B = kEnable;
}

Span received(Port port) {
  Channel& channel = g_channels[port];
  const uint8_t tail = channel.rx_tail, head = channel.rx_head;
  return {channel.rx + tail, static_cast<uint8_t>((head < tail ? kReceiveSize : head) - tail)};
}

void drop(Port port, uint8_t n) {
  Channel& channel = g_channels[port];
  finish_bytes();
  channel.rx_tail = in_receive(channel.rx_tail + n);
}

Span room(Port port) {
  Channel& channel = g_channels[port];
  const uint8_t tail = channel.tx_tail, head = channel.tx_head;
  const uint8_t free = in_transmit(tail - head - 1);
  const uint8_t to_end = kTransmitSize - head;
  return {channel.tx + head, free < to_end ? free : to_end};
}

void send(Port port, uint8_t n) {
  Channel& channel = g_channels[port];
  finish_bytes();
  channel.tx_head = in_transmit(channel.tx_head + n);
  // Set by the main program only and cleared by the interrupt only: a clear between read and
  // write of the register costs one idle interrupt and loses nothing.
  if (port == kUsb) {
    UCSR0B = kEnable | _BV(UDRIE0);
  } else {
    UCSR1B = kEnable | _BV(UDRIE1);
  }
}

bool has_received() {
  return g_channels[kUsb].rx_head != g_channels[kUsb].rx_tail ||
         g_channels[kBluetooth].rx_head != g_channels[kBluetooth].rx_tail;
}

ISR(USART0_RX_vect) {
  const uint8_t status = UCSR0A;  // before the data register, which moves the queue on
  on_received(g_channels[kUsb], status, UDR0);
}
ISR(USART1_RX_vect) {
  const uint8_t status = UCSR1A;
  on_received(g_channels[kBluetooth], status, UDR1);
}
ISR(USART0_UDRE_vect) {
  if (on_empty(g_channels[kUsb], UDR0)) UCSR0B = kEnable;
}
ISR(USART1_UDRE_vect) {
  if (on_empty(g_channels[kBluetooth], UDR1)) UCSR1B = kEnable;
}

}  // namespace uart
}  // namespace hil
