// The kernel's board played by the firmware's own ELF: true time and chunks on one side, processor
// cycles and single bytes on the other.
#pragma once

#include <cstdint>
#include <string>

#include "../kernel_board.hpp"
#include "chip.hpp"

namespace pil {

struct SimavrOptions {
  std::string elf_path;
  char uart = '1';         // '0' USB, '1' Bluetooth: the one the host is on
  double clock_ppm = 0.0;  // board clock fast against true time
  std::string eeprom;      // first bytes at the first power-up, the rest erased
};

class SimavrBoard final : public twin::BoardSide {
 public:
  explicit SimavrBoard(const SimavrOptions& options);

  void set_reset(bool held, std::int64_t t_us, const std::uint8_t pins[2]) override;
  void edge(const twin::PinEdge& edge) override;
  void receive(std::int64_t t_us, std::string bytes) override;
  void advance_to(std::int64_t t_us, double battery_v) override;
  double duty(int side) const override { return held_ ? 0.0 : chip_.duty(side); }

  Chip& chip() { return chip_; }
  Cycle cycle_at(double t_us) const { return static_cast<Cycle>(t_us * cycles_per_us_ + 0.5); }

 private:
  void collect_sent();

  Chip chip_;
  double cycles_per_us_;
  bool held_ = true;
  Cycle line_free_ = 0;  // when the last byte given to the receive line will be in
  std::string sent_bytes_;
  Cycle sent_done_ = 0;
};

}  // namespace pil
