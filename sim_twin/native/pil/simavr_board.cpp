#include "simavr_board.hpp"

#include <algorithm>
#include <cmath>

namespace pil {
namespace {

// Bytes sent back to back make one chunk; a burst longer than this is cut, as a radio would.
constexpr std::size_t kChunkBytes = 64;

}  // namespace

SimavrBoard::SimavrBoard(const SimavrOptions& options)
    : chip_(options.elf_path, options.uart), cycles_per_us_(kClock_mhz * (1.0 + 1e-6 * options.clock_ppm)) {
  chip_.set_eeprom(options.eeprom);
}

void SimavrBoard::set_reset(bool held, std::int64_t t_us, const std::uint8_t pins[2]) {
  const bool was_held = held_;
  held_ = held;
  sent_bytes_.clear();
  chip_.sent().clear();
  chip_.drop_line();
  line_free_ = 0;
  if (held) return;
  for (int side = 0; side < 2; ++side) chip_.set_encoder(side, pins[side]);
  if (t_us == 0) {
    chip_.power_up(0);
  } else if (was_held) {
    chip_.external_reset(cycle_at(static_cast<double>(t_us)));
  }
}

void SimavrBoard::edge(const twin::PinEdge& edge) {
  if (!held_) chip_.set_encoder_at(cycle_at(edge.t_us), edge.side, edge.ab);
}

void SimavrBoard::receive(std::int64_t t_us, std::string bytes) {
  if (held_) return;
  const Cycle byte = chip_.byte_cycles();
  const Cycle end = cycle_at(static_cast<double>(t_us));
  const Cycle length = byte * bytes.size();
  Cycle start = std::max({end > length ? end - length : 0, line_free_, chip_.now()});
  for (const char c : bytes) {
    chip_.receive(start, static_cast<std::uint8_t>(c));
    start += byte;
  }
  line_free_ = start;
}

void SimavrBoard::advance_to(std::int64_t t_us, double battery_v) {
  if (held_) return;
  chip_.set_battery(battery_v);
  chip_.run_to(cycle_at(static_cast<double>(t_us)));
  collect_sent();
}

void SimavrBoard::collect_sent() {
  for (const SentByte& sent : chip_.sent()) {
    sent_bytes_.push_back(static_cast<char>(sent.byte));
    sent_done_ = sent.done;
  }
  chip_.sent().clear();
  const bool idle = sent_done_ <= chip_.now();  // the next byte would be in the UART by now
  if (sent_bytes_.empty() || (!idle && sent_bytes_.size() < kChunkBytes)) return;
  sent.push_back({std::llround(static_cast<double>(sent_done_) / cycles_per_us_), sent_bytes_});
  sent_bytes_.clear();
}

}  // namespace pil
