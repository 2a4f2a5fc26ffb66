#include "host_port.h"

#include "ticker.h"
#include "uart.h"

namespace hil {
namespace host_port {
namespace {

// A port without a good frame for this long gives way to the other when that one has bytes: a line
// full of noise then keeps the board for a second at most.
constexpr uint32_t kSilence_us = 1000000UL;

uart::Port g_host = uart::kBluetooth;
uint32_t g_heard_us;
uint32_t g_frames;

uart::Port other(uart::Port port) { return port == uart::kUsb ? uart::kBluetooth : uart::kUsb; }

void receive(Board& board) {
  const uart::Span bytes = uart::received(g_host);
  if (bytes.size == 0) return;
  const uint32_t now_us = ticker::now_us();
  board.wired = g_host == uart::kUsb;
  uart::drop(g_host, static_cast<uint8_t>(board_receive(board, bytes.data, bytes.size, now_us)));
  const uint32_t frames = board_heard(board);
  if (frames == g_frames) return;
  g_frames = frames;
  g_heard_us = now_us;
}

void watch_other() {
  const uart::Port port = other(g_host);
  const uart::Span bytes = uart::received(port);
  if (bytes.size == 0) return;
  const uint32_t now_us = ticker::now_us();
  if (now_us - g_heard_us < kSilence_us) return uart::drop(port, bytes.size);
  g_host = port;
  g_heard_us = now_us;
}

void transmit(Board& board) {
  for (;;) {
    const uart::Span room = uart::room(g_host);
    const uint8_t n = board_transmit(board, room.data, room.size);
    if (n == 0) return;
    uart::send(g_host, n);
  }
}

}  // namespace

void pump(Board& board) {
  receive(board);
  watch_other();
  transmit(board);
}

}  // namespace host_port
}  // namespace hil
