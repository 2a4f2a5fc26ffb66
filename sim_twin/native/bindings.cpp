// Python module sim_twin._native: plant, kernel and (render_bind.cpp) the camera renderer.
// Signatures and units for Python readers: sim_twin/_native.pyi.
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstring>
#include <memory>
#include <optional>
#include <stdexcept>

#include "kernel.hpp"
#include "processor.hpp"

namespace nb = nanobind;
using namespace nb::literals;

void bind_lanes(nb::module_& m);   // lanes_bind.cpp
void bind_render(nb::module_& m);  // render_bind.cpp
void bind_rig(nb::module_& m);     // rig_bind.cpp

namespace {

using twin::Kernel;
using twin::PlantParams;

nb::bytes to_bytes(const std::string& text) { return nb::bytes(text.data(), text.size()); }

nb::tuple names(std::initializer_list<const char*> list) {
  nb::list out;
  for (const char* name : list) out.append(name);
  return nb::tuple(out);
}

void bind_names(nb::module_& m) {
#define X(name) #name,
  m.attr("PARAMETERS") = names({TWIN_PLANT_PARAMETERS(X)});
#undef X
#define X(id, name) name,
  m.attr("LOADS") = names({TWIN_LOADS(X)});
  m.attr("SHAPES") = names({TWIN_SHAPES(X)});
  m.attr("FAULTS") = names({TWIN_FAULTS(X)});
#undef X
  m.attr("STATES") = names({"x_m", "y_m", "theta_rad", "eta1_m_s", "eta2_m_s", "theta_dot_rad_s",
                            "current_left_a", "current_right_a", "wheel_left_rad", "wheel_right_rad",
                            "omega_left_rad_s", "omega_right_rad_s", "charge_ratio"});
}

twin::Drive duty(double left, double right) {
  twin::Drive drive;
  drive.duty = twin::Pair{left, right};
  return drive;
}

void bind_processor(nb::module_& m) {
  m.attr("CHAINS") = names({"sum", "product", "quotient", "root", "sine"});
  m.def(
      "chained",
      [](int chain, std::int64_t operations) {
        if (chain < 0 || chain >= twin::kChains) throw nb::value_error("chain: not one of CHAINS");
        return twin::chained(static_cast<twin::Chain>(chain), operations);
      },
      "chain"_a, "operations"_a);
  m.def("widest_register", &twin::widest_register);
  m.def("side_by_side", &twin::side_by_side, "width"_a, "operations"_a, "quotients"_a = false);
}

void bind_plant(nb::module_& m) {
  nb::class_<PlantParams>(m, "PlantParams")
      .def(nb::init<>())
#define X(name) .def_rw(#name, &PlantParams::name)
          TWIN_PLANT_PARAMETERS(X)
#undef X
      .def_rw("castor", &PlantParams::castor)
      .def_rw("castor_friction_ratio", &PlantParams::castor_friction_ratio)
      .def_rw("slip", &PlantParams::slip)
      .def_rw("lifted", &PlantParams::lifted);

  using twin::LoadVector;
  using twin::Plant;
  using twin::StateVector;
  nb::class_<Plant>(m, "Plant")
      .def(nb::init<const PlantParams&>(), "params"_a)
      .def("reset", &Plant::reset, "x_m"_a, "y_m"_a, "theta_rad"_a)
      .def_prop_rw(
          "state", [](const Plant& p) { return p.state(); },
          [](Plant& p, const StateVector& x) { p.changed_state() = x; })
      .def(
          "step",
          [](Plant& p, double h_s, double left, double right, const LoadVector& loads) {
            p.step(h_s, duty(left, right), loads, loads, loads);
          },
          "h_s"_a, "duty_left"_a, "duty_right"_a, "loads"_a)
      .def(
          "run",
          [](Plant& p, std::int64_t steps, double h_s, double left, double right,
             const std::optional<LoadVector>& loads) {
            const twin::Drive drive = duty(left, right);
            for (std::int64_t i = 0; i < steps; ++i) {
              if (loads)
                p.step(h_s, drive, *loads, *loads, *loads);
              else
                p.step(h_s, drive);
            }
          },
          "steps"_a, "h_s"_a, "duty_left"_a, "duty_right"_a, "loads"_a.none())
      .def(
          "derivative",
          [](const Plant& p, double left, double right, const LoadVector& loads) {
            return p.derivative(p.state(), duty(left, right), loads);
          },
          "duty_left"_a, "duty_right"_a, "loads"_a)
      .def(
          "battery_v",
          [](const Plant& p, double left, double right) { return p.battery_v(duty(left, right), 0.0); },
          "duty_left"_a, "duty_right"_a);
}

twin::Disturbance disturbance(int load, int shape, double amplitude, double start_s, double end_s,
                              double frequency_hz, double phase_rad, std::uint64_t seed,
                              std::array<double, 3> zone) {
  if (load < 0 || load >= twin::kLoads) throw std::invalid_argument("no such load");
  return {load,      static_cast<twin::Shape>(shape),
          amplitude, start_s,
          end_s,     frequency_hz,
          phase_rad, seed,
          zone[0],   zone[1],
          zone[2]};
}

nb::tuple kernel_state(const Kernel& k) {
  const twin::StateVector& x = k.state();
  return nb::make_tuple(x[twin::kX], x[twin::kY], x[twin::kTheta], x[twin::kEta1], x[twin::kEta2],
                        x[twin::kThetaDot], x[twin::kCurrentL], x[twin::kCurrentR], x[twin::kWheelL],
                        x[twin::kWheelR], x[twin::kOmegaL], x[twin::kOmegaR], x[twin::kCharge]);
}

nb::list kernel_sent(Kernel& k) {
  nb::list out;
  for (const twin::Chunk& chunk : k.take_sent()) {
    out.append(nb::make_tuple(chunk.t_us, to_bytes(chunk.bytes)));
  }
  return out;
}

// A board is handed about as a capsule, so that it may come from another module (sim_twin._pil).
using BoardPointer = std::shared_ptr<twin::BoardSide>;
constexpr char kBoardHandle[] = "twin::BoardSide";

nb::capsule host_board(double clock_ppm, std::uint32_t clock_start_us, double baud, bool wired,
                       const nb::bytes& eeprom) {
  const twin::HostBoardOptions options{clock_ppm, clock_start_us, 10e6 / baud, wired,
                                       std::string(eeprom.c_str(), eeprom.size())};
  return nb::capsule(new BoardPointer(std::make_shared<twin::HostBoard>(options)), kBoardHandle,
                     [](void* p) noexcept { delete static_cast<BoardPointer*>(p); });
}

void make_kernel(Kernel* self, const PlantParams& params, std::int64_t step_us, int counts_per_turn,
                 const nb::capsule& board) {
  if (std::strcmp(board.name(), kBoardHandle) != 0) throw nb::type_error("not a board's handle");
  new (self) Kernel(params, {step_us, counts_per_turn}, *static_cast<BoardPointer*>(board.data()));
}

// Called with (t_us, (left V, right V), loads, (left, right) jam in N m s/rad).
using OutsideFunction = std::function<twin::StateVector(std::int64_t, std::array<double, 2>, twin::LoadVector,
                                                        std::array<double, 2>)>;

void set_outside(Kernel& kernel, OutsideFunction outside, std::int64_t period_us) {
  kernel.set_outside(
      [outside](std::int64_t t_us, const twin::Pair& volts, const twin::LoadVector& loads,
                const twin::Pair& jam) {
        return outside(t_us, {volts[0], volts[1]}, loads, {jam[0], jam[1]});
      },
      period_us);
}

void bind_kernel(nb::module_& m) {
  m.def(
      "disturbance_value",
      [](int shape, double amplitude, double start_s, double end_s, double frequency_hz, double phase_rad,
         std::uint64_t seed, std::array<double, 3> zone, double t_s, double x_m, double y_m) {
        return twin::disturbance_value(
            disturbance(0, shape, amplitude, start_s, end_s, frequency_hz, phase_rad, seed, zone), t_s, x_m,
            y_m);
      },
      "shape"_a, "amplitude"_a, "start_s"_a, "end_s"_a, "frequency_hz"_a, "phase_rad"_a, "seed"_a, "zone"_a,
      "t_s"_a, "x_m"_a, "y_m"_a);
  nb::class_<twin::Encoder>(m, "Encoder")
      .def(nb::init<int>(), "counts_per_turn"_a)
      .def(
          "move",
          [](twin::Encoder& encoder, double angle_rad, double t0_us, double h_us, bool dead_a, bool dead_b,
             bool swapped) {
            std::vector<twin::PinEdge> edges;
            encoder.move(angle_rad, t0_us, h_us, {dead_a, dead_b, swapped, false, false}, 0, edges);
            std::vector<std::pair<double, int>> out;
            for (const auto& edge : edges) out.emplace_back(edge.t_us, edge.ab);
            return out;
          },
          "angle_rad"_a, "t0_us"_a, "h_us"_a, "dead_a"_a = false, "dead_b"_a = false, "swapped"_a = false);
  m.def("host_board", &host_board, "clock_ppm"_a, "clock_start_us"_a, "baud"_a, "wired"_a = false,
        "eeprom"_a = nb::bytes("", 0));
  nb::class_<Kernel>(m, "Kernel")
      .def("__init__", &make_kernel, "params"_a, "step_us"_a, "counts_per_turn"_a, "board"_a)
      .def("reset", &Kernel::reset, "x_m"_a, "y_m"_a, "theta_rad"_a)
      .def(
          "add_disturbance",
          [](Kernel& k, int load, int shape, double amplitude, double start_s, double end_s,
             double frequency_hz, double phase_rad, std::uint64_t seed, std::array<double, 3> zone) {
            k.add_disturbance(
                disturbance(load, shape, amplitude, start_s, end_s, frequency_hz, phase_rad, seed, zone));
          },
          "load"_a, "shape"_a, "amplitude"_a, "start_s"_a, "end_s"_a, "frequency_hz"_a, "phase_rad"_a,
          "seed"_a, "zone"_a)
      .def(
          "add_fault",
          [](Kernel& k, int kind, bool left, bool right, double start_s, double end_s, double strength) {
            k.add_fault({static_cast<twin::FaultKind>(kind), left, right, start_s, end_s, strength});
          },
          "kind"_a, "left"_a, "right"_a, "start_s"_a, "end_s"_a, "strength"_a = 1.0)
      .def("set_outside", &set_outside, "outside"_a, "period_us"_a)
      .def("begin", &Kernel::begin, "t_us"_a)
      .def("advance", &Kernel::advance, "t_us"_a)
      .def(
          "receive",
          [](Kernel& k, std::int64_t t_us, nb::bytes data) {
            k.receive(t_us, std::string(data.c_str(), data.size()));
          },
          "t_us"_a, "data"_a)
      .def("take_sent", &kernel_sent)
      .def(
          "pose_at",
          [](const Kernel& k, double t_us) {
            const twin::PoseSample p = k.pose_at(t_us);
            return nb::make_tuple(p.x_m, p.y_m, p.theta_rad);
          },
          "t_us"_a)
      .def("state", &kernel_state)
      .def_prop_ro("time_us", &Kernel::time_us)
      .def_prop_ro("battery_v", &Kernel::battery_v)
      .def_prop_ro("duty", [](const Kernel& k) { return std::pair(k.duty(0), k.duty(1)); })
      .def_prop_ro("true_counts",
                   [](const Kernel& k) { return std::pair(k.true_count(0), k.true_count(1)); });
}

}  // namespace

NB_MODULE(_native, m) {
  bind_names(m);
  bind_processor(m);
  bind_plant(m);
  bind_kernel(m);
  bind_lanes(m);
  bind_render(m);
  bind_rig(m);
}
