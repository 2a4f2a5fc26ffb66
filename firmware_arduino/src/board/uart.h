// The two serial ports, interrupt-driven: USB on UART 0 and Bluetooth on UART 1.
#pragma once

#include <stdint.h>

namespace hil {
namespace uart {

enum Port : uint8_t { kUsb, kBluetooth, kPorts };

constexpr uint32_t kBaud = 57600;

void start();

// A stretch of a ring, read or filled in place.
struct Span {
  uint8_t* data;
  uint8_t size;
};

// Received bytes, as far as they lie in one piece; drop() takes the first n of them off.
Span received(Port port);
void drop(Port port, uint8_t n);

// Room to put bytes to send, as far as it lies in one piece; send() takes the first n to be filled.
Span room(Port port);
void send(Port port, uint8_t n);

// Whether either port has received bytes; cheap enough to ask with interrupts off before sleeping.
bool has_received();

}  // namespace uart
}  // namespace hil
