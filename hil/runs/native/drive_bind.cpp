// The ticks of a run as hil.runs._native has them.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <type_traits>
#include <vector>

#include "drive.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

runs::BoardLimits board_of(const nb::tuple& board) {
  return {nb::cast<std::int64_t>(board[0]), nb::cast<double>(board[1]), nb::cast<double>(board[2])};
}

}  // namespace

void bind_drive(nb::module_& m) {
  using runs::Drive;
  nb::class_<Drive>(m, "Drive")
      .def(
          "__init__",
          [](Drive* self, runs::Pump& pump, runs::Watch& watch, outer::OuterLaw& law,
             outer::Reference& reference, nb::handle geometry, double t0_s, double period_s,
             std::int64_t ticks, const Drive::Keys& common, const Drive::Keys& own) {
            outer::BelievedGeometry believed;
            outer::fields(believed, [&](const char* name, auto& value) {
              value = nb::cast<std::decay_t<decltype(value)>>(geometry.attr(name));
            });
            new (self) Drive(pump, watch, law, reference, believed, {t0_s, period_s, ticks}, common, own);
          },
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(),
          nb::kw_only(), "pump"_a, "watch"_a, "law"_a, "reference"_a, "geometry"_a, "t0_s"_a, "period_s"_a,
          "ticks"_a, "common"_a, "own"_a)
      .def(
          "run",
          [](Drive& drive, bool busy, bool refused, const nb::tuple& board) {
            return static_cast<int>(drive.run(busy, refused, board_of(board)));
          },
          "busy"_a, "refused"_a, "board"_a)
      .def_prop_ro("reached_s", &Drive::reached_s)
      .def("take_rows", [](Drive& drive) {
        nb::bytes out(reinterpret_cast<const char*>(drive.rows.data()), drive.rows.size() * sizeof(double));
        drive.rows.clear();
        return out;
      });
  m.attr("DONE") = static_cast<int>(Drive::kDone);
  m.attr("DRIVE_HEARD") = static_cast<int>(Drive::kHeard);
  m.attr("DRIVE_TAKEN") = static_cast<int>(Drive::kTaken);
  m.attr("ASKED") = static_cast<int>(Drive::kAsked);
}
