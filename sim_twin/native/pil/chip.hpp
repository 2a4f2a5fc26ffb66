// The ATmega2560 with the firmware's ELF in it, under simavr: pins, UART, converter and clock.
// Where simavr 1.6 departs from the silicon in a way this firmware meets, the difference is made up
// here; docs/simavr-ledger.md lists each one.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "mega2560.hpp"
#include "profiler.hpp"

struct avr_t;
struct avr_io_t;
struct avr_irq_t;
struct avr_ioport_t;
struct avr_uart_t;

namespace pil {

struct SentByte {
  Cycle done;  // stop bit has left
  std::uint8_t byte;
};

// What a run has cost, in processor cycles since power-up.
struct Usage {
  Cycle asleep = 0;
  struct Interrupt {
    std::uint64_t count = 0;
    Cycle sum = 0, worst = 0;  // response and return included
  };
  std::array<Interrupt, kVectors> interrupt{};
  std::uint64_t watchdog_resets = 0;
  std::uint64_t wrong_sleeps = 0;  // sleep instruction outside the enabled idle mode
};

class Chip {
 public:
  // `uart` is '0' (USB) or '1' (Bluetooth): the one whose line is connected.
  Chip(const std::string& elf_path, char uart);
  ~Chip();
  Chip(const Chip&) = delete;
  Chip& operator=(const Chip&) = delete;

  // Reset at a cycle not before now. Power-up also paints the RAM and forgets the usage.
  void power_up(Cycle at);
  void external_reset(Cycle at);
  void run_to(Cycle end);  // throws when the processor has stopped for good
  Cycle now() const;

  void set_encoder(int side, std::uint8_t ab);               // now
  void set_encoder_at(Cycle at, int side, std::uint8_t ab);  // in time order of each side
  void set_battery(double battery_v);                        // at the robot's terminals
  void receive(Cycle start, std::uint8_t byte);              // start bit at that cycle, in order
  void drop_line();                                          // what is still on its way is lost
  std::vector<SentByte>& sent() { return sent_; }
  Cycle byte_cycles() const;    // of the connected UART
  double duty(int side) const;  // of the battery voltage, -1..1

  void jump(std::uint32_t address);  // program counter, in bytes
  std::string memory(std::uint32_t address, std::uint32_t size) const;
  std::string eeprom(std::uint32_t size) const;
  void set_eeprom(const std::string& bytes);
  int stack_used() const;  // deepest since power-up, bytes
  // Keeps a copy of a piece of RAM one run after the byte at `trigger` has changed between two, so
  // that whatever was being written with it is complete.
  void watch(std::uint32_t trigger, std::uint32_t address, std::uint32_t size);
  std::vector<std::string>& watched() { return watched_; }
  const Usage& usage() const { return usage_; }
  Profiler& profiler() { return profiler_; }
  const std::vector<std::string>& complaints() const { return complaints_; }
  void complain(std::string text) { complaints_.push_back(std::move(text)); }

 private:
  struct Level {
    Cycle at;
    int side;
    std::uint8_t ab;
  };
  struct Incoming {
    Cycle start;
    std::uint8_t byte;
  };

  avr_io_t* module(const char* kind, char name) const;
  void load(const std::string& elf_path);
  void attach();
  void reset(Cycle at, std::uint8_t cause);
  void after_reset();
  void run_profiled();
  void check_alive() const;
  void look();
  void arm_timers();

  static Cycle on_edges(avr_t*, Cycle when, void* self);
  static Cycle on_incoming(avr_t*, Cycle when, void* self);
  static Cycle on_barrier(avr_t* avr, Cycle, void*);
  static void on_interrupt(avr_irq_t* irq, std::uint32_t running, void* self);
  static void on_output(avr_irq_t* irq, std::uint32_t byte, void* self);
  static void on_sleep(avr_t* avr, Cycle cycles);
  static void write_compare(avr_t* avr, Address address, std::uint8_t value, void* whole);
  static void write_top(avr_t* avr, Address address, std::uint8_t value, void* half);
  static void write_divider(avr_t* avr, Address address, std::uint8_t value, void* self);

  avr_t* avr_ = nullptr;
  char uart_name_;
  avr_uart_t* uart_ = nullptr;
  avr_irq_t* uart_in_ = nullptr;
  avr_irq_t* battery_in_ = nullptr;
  avr_ioport_t* port_[2] = {};
  void (*divider_write_)(avr_t*, Address, std::uint8_t, void*) = nullptr;
  void* divider_param_ = nullptr;

  std::uint8_t level_[2] = {};        // encoder lines as they are outside
  std::uint16_t compare_[2][2] = {};  // [side][forward, backward], as last written whole
  struct Top {
    const BridgeHalf* half;
    std::uint16_t value;
  };
  Top top_[2] = {{&kBridge[0], 0}, {&kBridge[1], 0}};  // ICRn, as taken
  std::uint32_t program_end_ = kRamStart;              // first RAM address behind the program's variables
  std::deque<Level> levels_;
  std::deque<Incoming> incoming_;
  std::vector<SentByte> sent_;
  Cycle sent_done_ = 0;
  Cycle interrupt_from_ = 0;
  bool interrupted_ = false;
  std::uint32_t watch_trigger_ = 0, watch_address_ = 0, watch_size_ = 0;
  std::uint8_t watch_last_ = 0;
  bool watch_due_ = false;
  std::vector<std::string> watched_;
  Usage usage_;
  Profiler profiler_;
  std::vector<std::string> complaints_;
};

}  // namespace pil
