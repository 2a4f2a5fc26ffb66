#include "profiler.hpp"

#include <algorithm>

namespace pil {
namespace {

constexpr std::uint16_t kReturnAddressBytes = 3;  // 22-bit program counter

bool is_call(std::uint16_t opcode) {
  return (opcode & 0xFE0E) == 0x940E || (opcode & 0xF000) == 0xD000 || opcode == 0x9509 ||
         opcode == 0x9519;  // CALL, RCALL, ICALL, EICALL
}

bool is_return(std::uint16_t opcode) { return opcode == 0x9508 || opcode == 0x9518; }

}  // namespace

void Profiler::start(std::vector<std::uint8_t> part_of_word) {
  const std::uint8_t top = *std::max_element(part_of_word.begin(), part_of_word.end());
  *this = Profiler{};
  cycles_.assign(top + 1u, 0);
  part_of_word_ = std::move(part_of_word);
}

void Profiler::executed(const Instruction& it, Cycle now) {
  const std::uint8_t own = part_of_word_[it.pc / 2];
  const std::uint8_t part = own != 0 ? own : inherited_;
  cycles_[part] += it.cycles + carried_;
  carried_ = it.response;
  follow_calls(it, part);
  if (!it.interrupts_on && !off_) {
    off_ = true;
    off_since_ = now - it.response;
  } else if (it.interrupts_on && off_) {
    off_ = false;
    if (now - off_since_ > worst_off_) {
      worst_off_ = now - off_since_;
      worst_off_pc_ = it.pc;
    }
  }
}

// The stack pointer says which calls have ended; returns and interrupts need no pairing then.
void Profiler::follow_calls(const Instruction& it, std::uint8_t part) {
  const bool interrupted = it.response != 0;
  const auto sp = static_cast<std::uint16_t>(it.sp_after + (interrupted ? kReturnAddressBytes : 0));
  if (is_call(it.opcode)) {
    calls_.push_back({static_cast<std::uint16_t>(sp + kReturnAddressBytes), inherited_});
    inherited_ = part;
  } else if (is_return(it.opcode)) {
    while (!calls_.empty() && calls_.back().sp <= sp) {
      inherited_ = calls_.back().part;
      calls_.pop_back();
    }
  }
  if (interrupted) {
    calls_.push_back({sp, inherited_});
    inherited_ = 0;
  }
}

}  // namespace pil
