#include "kernel_board.hpp"

#include <algorithm>
#include <cmath>

namespace twin {
namespace {

// Battery divider 3:1 on a 10-bit converter with 5 V reference.
constexpr double kAdcStep_v = 3.0 * 5.0 / 1024.0;
// The core fills its transmit ring, the UART empties it: take no more than this ahead of the UART,
// so that the ring can fill up here as it does on the board. Long enough for a frame in one piece.
constexpr double kUartAhead_us = 20000.0;

void read_bytes(void* storage, std::uint16_t address, std::uint8_t* out, std::uint16_t n) {
  std::copy_n(static_cast<const std::uint8_t*>(storage) + address, n, out);
}

// The time that signatures take the processor is not the twin's: the processor in the loop has it.
void hash_all(hil::Board& board) {
  while (hil::board_idle(board)) {
  }
}

}  // namespace

HostBoard::HostBoard(const HostBoardOptions& options)
    : options_(options), eeprom_(hil::BOARD_STORAGE_SIZE, 0xFF) {
  std::copy_n(options.eeprom.begin(), std::min(options.eeprom.size(), eeprom_.size()), eeprom_.begin());
}

std::uint32_t HostBoard::clock_us(double t_us) const {
  const double own_us = (t_us - boot_us_) * (1.0 + 1e-6 * options_.clock_ppm);
  return clock_boot_us_ + static_cast<std::uint32_t>(static_cast<std::int64_t>(own_us));
}

// When the board's next period begins, on the true clock.
double HostBoard::next_tick_us() const {
  const double period_us = hil::TICK_US / (1.0 + 1e-6 * options_.clock_ppm);
  return boot_us_ + static_cast<double>(ticks_ + 1) * period_us;
}

void HostBoard::drive(const hil::BoardOutputs& outputs) {
  outputs_ = outputs;
  duty_[0] = static_cast<double>(outputs.pwm_left) / hil::PWM_TOP;
  duty_[1] = static_cast<double>(outputs.pwm_right) / hil::PWM_TOP;
}

void HostBoard::set_reset(bool held, std::int64_t t_us, const std::uint8_t pins[2]) {
  held_ = held;
  drive({});
  if (held) return;
  clock_boot_us_ = t_us == 0 ? options_.clock_start_us : 0;  // switched on before the run began
  boot_us_ = static_cast<double>(t_us);
  uart_free_us_ = boot_us_;
  ticks_ = 0;
  next_us_ = next_tick_us();
  edges_.clear();
  edges_done_ = 0;
  hil::board_init(board_);
  hil::board_load(board_, read_bytes, eeprom_.data());
  board_.wired = options_.wired;
  for (int side = 0; side < 2; ++side) encoder_[side] = hil::Quadrature{pins[side], 0, 0};
}

void HostBoard::receive(std::int64_t t_us, std::string bytes) {
  received_.push_back({t_us, std::move(bytes)});
}

void HostBoard::catch_up(double t_us) {
  for (; edges_done_ < edges_.size() && edges_[edges_done_].t_us <= t_us; ++edges_done_) {
    const PinEdge& edge = edges_[edges_done_];
    hil::quadrature_update(encoder_[edge.side], edge.ab);
  }
  while (!received_.empty() && static_cast<double>(received_.front().t_us) <= t_us) {
    const Chunk& chunk = received_.front();
    const auto at_us = static_cast<double>(chunk.t_us);
    if (!held_) {
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(chunk.bytes.data());
      for (std::size_t at = 0; at < chunk.bytes.size();) {
        const auto left = static_cast<std::uint16_t>(std::min<std::size_t>(chunk.bytes.size() - at, 0xFFFF));
        at += hil::board_receive(board_, bytes + at, left, clock_us(at_us));
        hash_all(board_);
      }
      transmit(at_us);
    }
    received_.pop_front();
  }
}

void HostBoard::transmit(double t_us) {
  const double ahead_us = std::max(uart_free_us_ - t_us, 0.0);
  const double room = (kUartAhead_us - ahead_us) / options_.byte_us;
  if (room < 1.0) return;
  std::uint8_t buffer[2048];
  const auto limit = static_cast<std::uint16_t>(std::min(room, double{sizeof buffer}));
  const std::uint16_t n = hil::board_transmit(board_, buffer, limit);
  if (n == 0) return;
  uart_free_us_ = t_us + ahead_us + n * options_.byte_us;
  sent.push_back({std::llround(uart_free_us_), std::string(reinterpret_cast<const char*>(buffer), n)});
}

void HostBoard::tick(double t_us, double battery_v) {
  const double steps = std::clamp(battery_v / kAdcStep_v, 0.0, 1023.0);
  hil::BoardInputs inputs{};
  inputs.t_us = clock_us(t_us);
  inputs.counts_left = encoder_[0].counts;
  inputs.counts_right = encoder_[1].counts;
  inputs.encoder_faults = static_cast<std::uint16_t>(encoder_[0].illegal + encoder_[1].illegal);
  inputs.battery_mv = static_cast<std::uint16_t>(1000.0 * kAdcStep_v * std::floor(steps));
  hil::BoardOutputs outputs = outputs_;
  hil::board_tick(board_, inputs, outputs);
  drive(outputs);
  hil::StoredByte byte{};
  if (hil::board_store(board_, byte)) eeprom_[byte.address] = byte.value;
  hil::board_slack(board_);
  hash_all(board_);
  transmit(t_us);
}

void HostBoard::advance_to(std::int64_t t_us, double battery_v) {
  const auto until_us = static_cast<double>(t_us);
  while (!held_ && next_us_ <= until_us) {
    catch_up(next_us_);
    tick(next_us_, battery_v);
    ++ticks_;
    next_us_ = next_tick_us();
  }
  catch_up(until_us);
  edges_.clear();
  edges_done_ = 0;
}

std::int64_t HostBoard::quiet_until_us() const {
  if (held_) return 0;
  const auto due_us = static_cast<std::int64_t>(next_us_);
  return received_.empty() ? due_us : std::min(due_us, received_.front().t_us);
}

bool HostBoard::takes_turns(const std::uint8_t pins[2]) const {
  return !held_ && edges_.empty() && encoder_[0].last_ab == pins[0] && encoder_[1].last_ab == pins[1];
}

// What quadrature_update makes of that many edges one after the other.
void HostBoard::turned(const std::int64_t counts[2], const std::uint8_t pins[2]) {
  for (int side = 0; side < 2; ++side) {
    encoder_[side].counts += static_cast<std::int32_t>(counts[side]);
    encoder_[side].last_ab = pins[side];
  }
}

}  // namespace twin
