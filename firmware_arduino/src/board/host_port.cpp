#include "host_port.h"

#include "ticker.h"
#include "uart.h"

namespace hil {
namespace host_port {
namespace {

constexpr uint8_t kPiece = 32;
// A port without a good frame for this long gives way to the other when that one has bytes: a line
// full of noise then takes the board for a second at most.
constexpr uint32_t kSilence_us = 1000000UL;

uart::Port g_host = uart::kBluetooth;
uint32_t g_heard_us;
uint16_t g_frames;

uart::Port other(uart::Port port) { return port == uart::kUsb ? uart::kBluetooth : uart::kUsb; }

void receive(Board& board) {
  uint8_t bytes[kPiece];
  while (const uint8_t n = uart::read(g_host, bytes, kPiece)) {
    board_receive(board, bytes, n, ticker::now_us());
  }
  if (board.link.received != g_frames) {
    g_frames = board.link.received;
    g_heard_us = ticker::now_us();
  }
  if (uart::read(other(g_host), bytes, kPiece) == 0) return;
  if (ticker::now_us() - g_heard_us < kSilence_us) return;
  g_host = other(g_host);
  g_heard_us = ticker::now_us();
}

void transmit(Board& board) {
  uint8_t bytes[kPiece];
  for (;;) {
    const uint8_t usb = uart::room(uart::kUsb), bluetooth = uart::room(uart::kBluetooth);
    const uint8_t room = usb < bluetooth ? usb : bluetooth;
    const uint8_t n = board_transmit(board, bytes, room < kPiece ? room : kPiece);
    if (n == 0) return;
    uart::write(uart::kUsb, bytes, n);
    uart::write(uart::kBluetooth, bytes, n);
  }
}

}  // namespace

void pump(Board& board) {
  receive(board);
  transmit(board);
}

}  // namespace host_port
}  // namespace hil
