// The two serial ports, interrupt-driven: USB on UART 0 and Bluetooth on UART 1.
#pragma once

#include <stdint.h>

namespace hil {
namespace uart {

enum Port : uint8_t { kUsb, kBluetooth, kPorts };

constexpr uint32_t kBaud = 57600;

void start();

// Up to `max` received bytes; returns how many.
uint8_t read(Port port, uint8_t* out, uint8_t max);

// Room in the transmit ring, in bytes.
uint8_t room(Port port);

// Queues `n` bytes; the caller has asked for room.
void write(Port port, const uint8_t* data, uint8_t n);

// Bytes received or waiting; cheap enough to ask with interrupts off before sleeping.
bool has_received();

// Received bytes dropped so far: ring full, or overrun and framing errors of the hardware.
uint16_t lost();

}  // namespace uart
}  // namespace hil
