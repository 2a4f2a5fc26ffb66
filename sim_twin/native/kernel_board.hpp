// The board as the simulated robot meets it: pins in, pins out, UART bytes with their times.
// HostBoard runs the firmware core compiled for this machine; a processor simulator fits behind the
// same class (edges carry their exact time, duty is read back after every step).
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "core/board.h"
#include "core/quadrature.h"

namespace twin {

// Level of one encoder's pins after an edge; ab = (A << 1) | B.
struct PinEdge {
  double t_us = 0.0;
  int side = 0;
  std::uint8_t ab = 0;
};

struct Chunk {
  std::int64_t t_us = 0;
  std::string bytes;
};

class BoardSide {
 public:
  virtual ~BoardSide() = default;
  // Power-up, and every change of the reset line; `pins` are the encoder levels at that moment.
  virtual void set_reset(bool held, std::int64_t t_us, const std::uint8_t pins[2]) = 0;
  // An edge between the last advance and the next one, in time order.
  virtual void edge(const PinEdge& edge) = 0;
  // Bytes whose last one reaches the board's UART at t_us; calls come in time order.
  virtual void receive(std::int64_t t_us, std::string bytes) = 0;
  // Run to t_us with the battery at this voltage.
  virtual void advance_to(std::int64_t t_us, double battery_v) = 0;
  // Before this nothing is due on the board, unless an edge or bytes come; what is not known is now.
  virtual std::int64_t quiet_until_us() const { return 0; }
  // Whether edges that all lie before the time it is quiet until may be handed over as how far each encoder
  // has turned; `pins` are their levels now. A board whose pins differ from them takes edges one by one.
  virtual bool takes_turns(const std::uint8_t /*pins*/[2]) const { return false; }
  // Counts that both encoders have moved by since the last advance, and the levels of their pins after it.
  virtual void turned(const std::int64_t /*counts*/[2], const std::uint8_t /*pins*/[2]) {}
  // Share of the battery voltage on a motor (0 left, 1 right), -1..1.
  virtual double duty(int side) const = 0;
  // What the UART has sent; t_us is the time its last byte left. Emptied by the caller.
  std::vector<Chunk> sent;
};

struct HostBoardOptions {
  double clock_ppm = 0.0;            // board clock fast against true time
  std::uint32_t clock_start_us = 0;  // board clock when the run begins
  double byte_us = 10e6 / 57600.0;   // UART time of one byte
  bool wired = false;                // the host is on the USB port, else on the Bluetooth one
  std::string eeprom;                // first bytes of it; the rest is as it comes new
};

class HostBoard final : public BoardSide {
 public:
  explicit HostBoard(const HostBoardOptions& options);
  void set_reset(bool held, std::int64_t t_us, const std::uint8_t pins[2]) override;
  void edge(const PinEdge& edge) override { edges_.push_back(edge); }
  void receive(std::int64_t t_us, std::string bytes) override;
  void advance_to(std::int64_t t_us, double battery_v) override;
  std::int64_t quiet_until_us() const override;
  bool takes_turns(const std::uint8_t pins[2]) const override;
  void turned(const std::int64_t counts[2], const std::uint8_t pins[2]) override;
  double duty(int side) const override { return duty_[side]; }

 private:
  std::uint32_t clock_us(double t_us) const;
  double next_tick_us() const;
  void drive(const hil::BoardOutputs& outputs);
  void catch_up(double t_us);  // edges and received bytes up to t_us
  void tick(double t_us, double battery_v);
  void transmit(double t_us);

  HostBoardOptions options_;
  hil::Board board_{};
  hil::Quadrature encoder_[2]{};
  hil::BoardOutputs outputs_{};
  double duty_[2] = {0.0, 0.0};  // what the outputs are to the motors
  double next_us_ = 0.0;         // of the next period
  std::vector<PinEdge> edges_;
  std::size_t edges_done_ = 0;
  std::deque<Chunk> received_;
  std::vector<std::uint8_t> eeprom_;  // keeps what it holds through a reset
  bool held_ = true;
  double boot_us_ = 0.0;  // true time at which the board's clock showed clock_boot_us_
  std::uint32_t clock_boot_us_ = 0;
  std::int64_t ticks_ = 0;
  double uart_free_us_ = 0.0;  // when the last byte given to the UART will have left
};

}  // namespace twin
