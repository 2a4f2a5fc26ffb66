// Python module sim_twin._pil: the processor in the loop. Signatures: sim_twin/_pil.pyi.
#include <nanobind/nanobind.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <memory>

#include "simavr_board.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using pil::Chip;
using pil::SimavrBoard;
using BoardPointer = std::shared_ptr<twin::BoardSide>;

std::string text_of(const nb::bytes& data) { return {data.c_str(), data.size()}; }
nb::bytes bytes_of(const std::string& data) { return nb::bytes(data.data(), data.size()); }

// What sim_twin._native.Kernel takes as its board: a shared pointer of the two modules' own class.
nb::capsule handle(const std::shared_ptr<SimavrBoard>& board) {
  return nb::capsule(new BoardPointer(board), "twin::BoardSide",
                     [](void* p) noexcept { delete static_cast<BoardPointer*>(p); });
}

nb::dict usage(SimavrBoard& board) {
  const pil::Usage& use = board.chip().usage();
  nb::dict interrupts;
  for (int vector = 0; vector < pil::kVectors; ++vector) {
    const auto& it = use.interrupt[static_cast<std::size_t>(vector)];
    if (it.count != 0) interrupts[nb::int_(vector)] = nb::make_tuple(it.count, it.sum, it.worst);
  }
  nb::dict out;
  out["cycles"] = board.chip().now();
  out["asleep"] = use.asleep;
  out["watchdog_resets"] = use.watchdog_resets;
  out["wrong_sleeps"] = use.wrong_sleeps;
  out["interrupts"] = interrupts;
  return out;
}

nb::tuple profile(SimavrBoard& board) {
  const pil::Profiler& p = board.chip().profiler();
  return nb::make_tuple(p.cycles(), p.worst_interrupts_off(), p.worst_interrupts_off_pc());
}

}  // namespace

NB_MODULE(_pil, m) {
  nb::class_<SimavrBoard>(m, "Board")
      .def(
          "__init__",
          [](SimavrBoard* self, std::string elf, char uart, double clock_ppm, nb::bytes eeprom) {
            new (self) SimavrBoard({std::move(elf), uart, clock_ppm, text_of(eeprom)});
          },
          "elf_path"_a, "uart"_a, "clock_ppm"_a, "eeprom"_a)
      .def("handle", &handle)
      .def(
          "power_up",
          [](SimavrBoard& b, int left_ab, int right_ab) {
            const std::uint8_t pins[2] = {static_cast<std::uint8_t>(left_ab),
                                          static_cast<std::uint8_t>(right_ab)};
            b.set_reset(false, 0, pins);
          },
          "left_ab"_a = 0, "right_ab"_a = 0)
      .def(
          "edge",
          [](SimavrBoard& b, double t_us, int side, int ab) {
            b.edge({t_us, side, static_cast<std::uint8_t>(ab)});
          },
          "t_us"_a, "side"_a, "ab"_a)
      .def(
          "receive",
          [](SimavrBoard& b, std::int64_t t_us, nb::bytes data) { b.receive(t_us, text_of(data)); }, "t_us"_a,
          "data"_a)
      .def("advance_to", &SimavrBoard::advance_to, "t_us"_a, "battery_v"_a)
      .def("take_sent",
           [](SimavrBoard& b) {
             nb::list out;
             for (const auto& chunk : b.sent) {
               out.append(nb::make_tuple(chunk.t_us, bytes_of(chunk.bytes)));
             }
             b.sent.clear();
             return out;
           })
      .def("duty", &SimavrBoard::duty, "side"_a)
      .def(
          "jump", [](SimavrBoard& b, std::uint32_t pc) { b.chip().jump(pc); }, "address"_a)
      .def(
          "memory",
          [](SimavrBoard& b, std::uint32_t address, std::uint32_t size) {
            return bytes_of(b.chip().memory(address, size));
          },
          "address"_a, "size"_a)
      .def(
          "watch",
          [](SimavrBoard& b, std::uint32_t trigger, std::uint32_t address, std::uint32_t size) {
            b.chip().watch(trigger, address, size);
          },
          "trigger"_a, "address"_a, "size"_a)
      .def("take_watched",
           [](SimavrBoard& b) {
             nb::list out;
             for (const auto& piece : b.chip().watched()) out.append(bytes_of(piece));
             b.chip().watched().clear();
             return out;
           })
      .def(
          "eeprom", [](SimavrBoard& b, std::uint32_t size) { return bytes_of(b.chip().eeprom(size)); },
          "size"_a)
      .def(
          "set_eeprom", [](SimavrBoard& b, nb::bytes data) { b.chip().set_eeprom(text_of(data)); }, "data"_a)
      .def(
          "start_profile",
          [](SimavrBoard& b, nb::bytes part_of_word) {
            const auto* first = reinterpret_cast<const std::uint8_t*>(part_of_word.c_str());
            b.chip().profiler().start({first, first + part_of_word.size()});
          },
          "part_of_word"_a)
      .def("stop_profile", [](SimavrBoard& b) { b.chip().profiler().stop(); })
      .def("profile", &profile)
      .def("usage", &usage)
      .def_prop_ro("byte_cycles", [](SimavrBoard& b) { return b.chip().byte_cycles(); })
      .def_prop_ro("stack_used", [](SimavrBoard& b) { return b.chip().stack_used(); })
      .def_prop_ro("complaints", [](SimavrBoard& b) { return b.chip().complaints(); });
}
