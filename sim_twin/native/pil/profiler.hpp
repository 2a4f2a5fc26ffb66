// Cycles by part of the program, from the stream of executed instructions.
#pragma once

#include <cstdint>
#include <vector>

namespace pil {

using Cycle = std::uint64_t;

// A part is a number given to flash words from outside (sim_twin/pil_profile.py reads it off the
// debug information). Words of part 0, such as the soft-float library, count for their caller.
class Profiler {
 public:
  struct Instruction {
    std::uint32_t pc;  // bytes
    std::uint16_t opcode;
    std::uint16_t sp_after;
    Cycle cycles;
    Cycle response;      // cycles of entering an interrupt behind it, 0 when none was
    bool interrupts_on;  // behind it
  };

  void start(std::vector<std::uint8_t> part_of_word);
  void stop() { part_of_word_.clear(); }
  bool running() const { return !part_of_word_.empty(); }
  void executed(const Instruction& it, Cycle now);

  const std::vector<Cycle>& cycles() const { return cycles_; }  // by part
  Cycle worst_interrupts_off() const { return worst_off_; }
  std::uint32_t worst_interrupts_off_pc() const { return worst_off_pc_; }  // where it ended

 private:
  struct Frame {
    std::uint16_t sp;   // to which the return restores the stack pointer
    std::uint8_t part;  // inherited by the caller
  };

  void follow_calls(const Instruction& it, std::uint8_t part);

  std::vector<std::uint8_t> part_of_word_;
  std::vector<Cycle> cycles_;
  std::vector<Frame> calls_;
  std::uint8_t inherited_ = 0;
  Cycle carried_ = 0;  // interrupt response, due to the handler that comes next
  bool off_ = false;
  Cycle off_since_ = 0;
  Cycle worst_off_ = 0;
  std::uint32_t worst_off_pc_ = 0;
};

}  // namespace pil
