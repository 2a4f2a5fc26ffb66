#include "chip.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <stdexcept>

extern "C" {
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_interrupts.h>
#include <simavr/sim_io.h>
#include <simavr/sim_irq.h>
}

namespace pil {
namespace {

constexpr std::uint8_t kPaint = 0xC5;
// Interrupt response of a processor with a 22-bit program counter; simavr takes none.
constexpr Cycle kResponse = 5;
// Longest stretch between looks at the cycle timers: they bound it themselves, this is for a loop
// that polls.
constexpr Cycle kRunLimit = 100;
constexpr double kDivider = 3.0, kReference_v = 5.0;

// simavr has one log for all processors; each keeps what concerns it.
void log_line(avr_t* avr, const int level, const char* format, va_list arguments) {
  if (level != LOG_ERROR && level != LOG_WARNING) return;
  char text[256];
  std::vsnprintf(text, sizeof text, format, arguments);
  if (avr != nullptr && avr->custom.data != nullptr) {
    static_cast<Chip*>(avr->custom.data)->complain(text);
  }
}

}  // namespace

Chip::Chip(const std::string& elf_path, char uart) : uart_name_(uart) {
  avr_global_logger_set(log_line);
  avr_ = avr_make_mcu_by_name("atmega2560");
  if (avr_ == nullptr) throw std::runtime_error("this libsimavr has no atmega2560");
  avr_init(avr_);
  avr_->frequency = static_cast<std::uint32_t>(1e6 * kClock_mhz);
  avr_->vcc = avr_->avcc = avr_->aref = static_cast<std::uint32_t>(1000.0 * kReference_v);
  avr_->custom.data = this;
  avr_->sleep = on_sleep;
  load(elf_path);
  attach();
}

Chip::~Chip() {
  avr_terminate(avr_);
  std::free(avr_);
}

void Chip::load(const std::string& elf_path) {
  elf_firmware_t firmware;
  std::memset(&firmware, 0, sizeof firmware);
  if (elf_read_firmware(elf_path.c_str(), &firmware) != 0 || firmware.flash == nullptr) {
    throw std::runtime_error(elf_path + ": not an ELF of the board");
  }
  avr_load_firmware(avr_, &firmware);
  for (std::uint32_t i = 0; i < firmware.symbolcount; ++i) {  // RAM is at 0x800000 in the ELF
    const avr_symbol_t& symbol = *firmware.symbol[i];
    if (std::strcmp(symbol.symbol, "_end") == 0) program_end_ = symbol.addr & 0xFFFF;
  }
}

avr_io_t* Chip::module(const char* kind, char name) const {
  for (avr_io_t* io = avr_->io_port; io != nullptr; io = io->next) {
    if (std::strcmp(io->kind, kind) != 0) continue;
    const bool is_port = std::strcmp(kind, "port") == 0;
    const char own =
        is_port ? reinterpret_cast<avr_ioport_t*>(io)->name : reinterpret_cast<avr_uart_t*>(io)->name;
    if (own == name) return io;
  }
  throw std::runtime_error(std::string("this libsimavr has no ") + kind + " " + name);
}

void Chip::attach() {
  for (const char name : {'0', '1'}) {
    std::uint32_t flags = 0;  // neither print to our stdout nor sleep when polled
    avr_ioctl(avr_, AVR_IOCTL_UART_SET_FLAGS(name), &flags);
  }
  uart_ = reinterpret_cast<avr_uart_t*>(module("uart", uart_name_));
  uart_in_ = uart_->io.irq + UART_IRQ_INPUT;
  avr_irq_register_notify(uart_->io.irq + UART_IRQ_OUTPUT, on_output, this);
  auto& divider = avr_->io[AVR_DATA_TO_IO(uart_registers(uart_name_).ubrrl)].w;
  divider_write_ = divider.c;
  divider_param_ = divider.param;
  divider = {this, write_divider};
  battery_in_ = avr_io_getirq(avr_, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0);
  for (int vector = 1; vector < kVectors; ++vector) {
    avr_irq_t* irq = avr_get_interrupt_irq(avr_, static_cast<std::uint8_t>(vector));
    if (irq != nullptr) avr_irq_register_notify(irq + AVR_INT_IRQ_RUNNING, on_interrupt, this);
  }
  for (int side = 0; side < 2; ++side) {
    port_[side] = reinterpret_cast<avr_ioport_t*>(module("port", kEncoder[side].port));
    const Address compare[2] = {kBridge[side].ocra, kBridge[side].ocrb};
    for (int i = 0; i < 2; ++i) {
      avr_->io[AVR_DATA_TO_IO(compare[i])].w = {&compare_[side][i], write_compare};
    }
    avr_->io[AVR_DATA_TO_IO(kBridge[side].icr)].w = {&top_[side], write_top};
  }
}

void Chip::power_up(Cycle at) {
  std::memset(avr_->data + kRamStart, kPaint, kRamEnd + 1u - kRamStart);
  usage_ = {};
  complaints_.clear();
  reset(at, kPowerOnReset);
}

void Chip::external_reset(Cycle at) { reset(at, kExternalReset); }

void Chip::reset(Cycle at, std::uint8_t cause) {
  avr_->cycle = at;
  avr_reset(avr_);
  avr_->data[kMCUSR] = cause;
  after_reset();
}

// A reset clears pin levels, cycle timers and settings that belong to the outside world.
void Chip::after_reset() {
  std::memset(compare_, 0, sizeof compare_);
  for (Top& top : top_) top.value = 0;
  sent_done_ = 0;
  for (int side = 0; side < 2; ++side) set_encoder(side, level_[side]);
  arm_timers();
}

void Chip::arm_timers() {
  const auto arm = [this](Cycle at, avr_cycle_timer_t timer) {
    avr_cycle_timer_register(avr_, at > avr_->cycle ? at - avr_->cycle : 1, timer, this);
  };
  if (!levels_.empty()) arm(levels_.front().at, on_edges);
  if (!incoming_.empty()) arm(incoming_.front().start, on_incoming);
}

Cycle Chip::now() const { return avr_->cycle; }

void Chip::check_alive() const {
  if (avr_->state == cpu_Running || avr_->state == cpu_Sleeping) return;
  char where[80];
  std::snprintf(where, sizeof where, "the simulated processor stopped at flash address 0x%x",
                static_cast<unsigned>(avr_->pc));
  throw std::runtime_error(complaints_.empty() ? where : where + (": " + complaints_.back()));
}

void Chip::run_to(Cycle end) {
  if (end <= avr_->cycle) return;
  const Cycle limit = profiler_.running() ? 0 : kRunLimit;  // 0: one instruction a call
  const auto arm_barrier = [&] {                            // the processor must not sleep past the end
    avr_cycle_timer_register(avr_, end > avr_->cycle ? end - avr_->cycle : 1, on_barrier, this);
  };
  avr_->run_cycle_limit = limit;
  arm_barrier();
  arm_timers();
  while (avr_->cycle < end && avr_->state <= cpu_Sleeping) {
    if (profiler_.running()) {
      run_profiled();
    } else {
      avr_run(avr_);
    }
    if (avr_->run_cycle_limit == limit) continue;
    ++usage_.watchdog_resets;  // simavr has reset itself, and its limit to another value
    after_reset();
    avr_->run_cycle_limit = limit;
    arm_barrier();
  }
  check_alive();
  if (watch_size_ != 0) look();
}

void Chip::look() {
  if (watch_due_) watched_.push_back(memory(watch_address_, watch_size_));
  watch_due_ = avr_->data[watch_trigger_] != watch_last_;
  watch_last_ = avr_->data[watch_trigger_];
}

void Chip::watch(std::uint32_t trigger, std::uint32_t address, std::uint32_t size) {
  memory(trigger, 1);  // throws where there is no RAM
  memory(address, size);
  watch_trigger_ = trigger;
  watch_address_ = address;
  watch_size_ = size;
  watch_last_ = avr_->data[trigger];
}

void Chip::run_profiled() {
  avr_->run_cycle_count = 1;
  const bool was_running = avr_->state == cpu_Running;
  const std::uint32_t pc = avr_->pc;
  const Cycle before = avr_->cycle, asleep = usage_.asleep;
  interrupted_ = false;
  avr_run(avr_);
  if (!was_running) return;
  const Cycle response = interrupted_ ? kResponse : 0;
  const auto opcode = static_cast<std::uint16_t>(avr_->flash[pc] | avr_->flash[pc + 1] << 8);
  const auto sp = static_cast<std::uint16_t>(avr_->data[R_SPL] | avr_->data[R_SPH] << 8);
  const Cycle cycles = avr_->cycle - before - (usage_.asleep - asleep) - response;
  profiler_.executed({pc, opcode, sp, cycles, response, avr_->sreg[S_I] != 0}, avr_->cycle);
}

void Chip::set_encoder(int side, std::uint8_t ab) {
  const EncoderPins& pins = kEncoder[side];
  level_[side] = ab;
  const auto bit = [](int number) { return static_cast<std::uint8_t>(1u << number); };
  const std::uint8_t mask = bit(pins.bit_a) | bit(pins.bit_b);
  const std::uint8_t level = ((ab & 2) ? bit(pins.bit_a) : 0) | ((ab & 1) ? bit(pins.bit_b) : 0);
  // Driven from outside: a write to the port must not lift the line through the pull-up.
  port_[side]->external.pull_mask = mask;
  port_[side]->external.pull_value = level;
  avr_raise_irq(port_[side]->io.irq + pins.bit_a, (ab >> 1) & 1);
  avr_raise_irq(port_[side]->io.irq + pins.bit_b, ab & 1);
  // An unchanged level raises nothing, so that a reset would leave the register at zero.
  avr_->data[pins.pin] = static_cast<std::uint8_t>((avr_->data[pins.pin] & ~mask) | level);
}

// Stays due: a sleep instruction that falls on the barrier must not find it gone and skip to the next
// timer, past edges that the next run will bring.
Cycle Chip::on_barrier(avr_t* avr, Cycle, void*) { return avr->cycle + 1; }

void Chip::set_encoder_at(Cycle at, int side, std::uint8_t ab) {
  const auto later = [at](const Level& level) { return level.at > at; };
  levels_.insert(std::find_if(levels_.begin(), levels_.end(), later), {at, side, ab});
}

Cycle Chip::on_edges(avr_t*, Cycle when, void* self) {
  auto& chip = *static_cast<Chip*>(self);
  while (!chip.levels_.empty() && chip.levels_.front().at <= when) {
    chip.set_encoder(chip.levels_.front().side, chip.levels_.front().ab);
    chip.levels_.pop_front();
  }
  return chip.levels_.empty() ? 0 : chip.levels_.front().at;
}

void Chip::set_battery(double battery_v) {
  const double code = std::clamp(battery_v / kDivider / kReference_v * 1024.0, 0.0, 1023.0);
  // simavr takes millivolts and scales by 1023/5000; this gives back the code, rounded down.
  const auto whole = static_cast<std::uint32_t>(code);
  avr_raise_irq(battery_in_, (whole * 5000u + 1022u) / 1023u);
}

void Chip::receive(Cycle start, std::uint8_t byte) { incoming_.push_back({start, byte}); }

void Chip::drop_line() {
  incoming_.clear();
  avr_cycle_timer_cancel(avr_, on_incoming, this);
}

// simavr raises "received" one byte time after it was given the byte: that is the start bit.
Cycle Chip::on_incoming(avr_t*, Cycle when, void* self) {
  auto& chip = *static_cast<Chip*>(self);
  avr_raise_irq(chip.uart_in_, chip.incoming_.front().byte);
  chip.incoming_.pop_front();
  return chip.incoming_.empty() ? 0 : std::max(chip.incoming_.front().start, when + 1);
}

void Chip::on_output(avr_irq_t*, std::uint32_t byte, void* self) {
  auto& chip = *static_cast<Chip*>(self);
  chip.sent_done_ = std::max(chip.sent_done_, chip.avr_->cycle) + chip.byte_cycles();
  chip.sent_.push_back({chip.sent_done_, static_cast<std::uint8_t>(byte)});
}

Cycle Chip::byte_cycles() const { return uart_->cycles_per_byte; }

// simavr counts a parity bit in every byte; ours has none: 10 bits, not 11.
void Chip::write_divider(avr_t* avr, Address address, std::uint8_t value, void* self) {
  auto& chip = *static_cast<Chip*>(self);
  chip.divider_write_(avr, address, value, chip.divider_param_);
  chip.uart_->cycles_per_byte = chip.uart_->cycles_per_byte / 11 * 10;
}

// A 16-bit compare register takes its value whole, when the low byte is written. simavr knows no
// phase-correct mode on these timers and would only complain.
void Chip::write_compare(avr_t* avr, Address address, std::uint8_t value, void* whole) {
  avr->data[address] = value;
  *static_cast<std::uint16_t*>(whole) = static_cast<std::uint16_t>(value | avr->data[address + 1] << 8);
}

// ICRn takes a value in a mode only that uses it as top (datasheet, "input capture register"): 8, 10, 12, 14.
void Chip::write_top(avr_t* avr, Address address, std::uint8_t value, void* param) {
  Top& top = *static_cast<Top*>(param);
  avr->data[address] = value;
  const std::uint8_t b = avr->data[top.half->tccrb], a = avr->data[top.half->tccra];
  const bool is_top = (b & kTopModeB) != 0 && (a & kTopNotA) == 0;
  if (is_top) top.value = static_cast<std::uint16_t>(value | avr->data[address + 1] << 8);
}

double Chip::duty(int side) const {
  const BridgeHalf& half = kBridge[side];
  const std::uint8_t* data = avr_->data;
  const std::uint8_t outputs = half.forward_bit | half.backward_bit;
  const bool driven =
      (data[half.ddr] & outputs) == outputs && (data[kDDRA] & data[kPORTA] & half.enable_bit) != 0;
  const bool running = data[half.tccra] == kPwmModeA && (data[half.tccrb] & kPwmModeBMask) == kPwmModeB &&
                       (data[half.tccrb] & kClockMask) != 0;
  const int top = top_[side].value;
  if (!driven || !running || top == 0) return 0.0;
  const double forward = std::min<int>(compare_[side][0], top);
  const double backward = std::min<int>(compare_[side][1], top);
  return (forward - backward) / top;
}

void Chip::on_interrupt(avr_irq_t* irq, std::uint32_t running, void* self) {
  auto& chip = *static_cast<Chip*>(self);
  if (running != 0) {
    chip.interrupted_ = true;
    chip.interrupt_from_ = chip.avr_->cycle;
    chip.avr_->cycle += kResponse;
    return;
  }
  constexpr Cycle kReturn = 5;  // of RETI, which simavr adds behind this call
  Usage::Interrupt& use = chip.usage_.interrupt[irq->irq / 256];
  const Cycle cycles = chip.avr_->cycle + kReturn - chip.interrupt_from_;
  ++use.count;
  use.sum += cycles;
  use.worst = std::max(use.worst, cycles);
}

// Replaces simavr's own, which waits in wall time. Idle with the enable bit set is what keeps the
// timers and UARTs running on the silicon; simavr sleeps alike whatever the register says.
void Chip::on_sleep(avr_t* avr, Cycle cycles) {
  auto& chip = *static_cast<Chip*>(avr->custom.data);
  chip.usage_.asleep += cycles + 1;
  if ((avr->data[kSMCR] & kSleepModeMask) != kSleepEnableIdle) ++chip.usage_.wrong_sleeps;
}

void Chip::jump(std::uint32_t address) { avr_->pc = address; }

std::string Chip::memory(std::uint32_t address, std::uint32_t size) const {
  if (address > kRamEnd || size > kRamEnd + 1u - address) throw std::out_of_range("not in RAM");
  return {reinterpret_cast<const char*>(avr_->data + address), size};
}

std::string Chip::eeprom(std::uint32_t size) const {
  std::string out(size, '\0');
  avr_eeprom_desc_t part{reinterpret_cast<std::uint8_t*>(out.data()), 0, size};
  // simavr 1.6 says -1 for success here and -2 for a bad range.
  if (avr_ioctl(avr_, AVR_IOCTL_EEPROM_GET, &part) == -2) throw std::out_of_range("not in EEPROM");
  return out;
}

void Chip::set_eeprom(const std::string& bytes) {
  std::string copy = bytes;
  avr_eeprom_desc_t part{reinterpret_cast<std::uint8_t*>(copy.data()), 0,
                         static_cast<std::uint32_t>(copy.size())};
  if (!copy.empty() && avr_ioctl(avr_, AVR_IOCTL_EEPROM_SET, &part) == -2) {
    throw std::out_of_range("not in EEPROM");
  }
}

int Chip::stack_used() const {
  std::uint32_t lowest = program_end_;
  while (lowest <= kRamEnd && avr_->data[lowest] == kPaint) ++lowest;
  return static_cast<int>(kRamEnd + 1u - lowest);
}

}  // namespace pil
