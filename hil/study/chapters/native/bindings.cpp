// Python module hil.study.chapters._plants; signatures and units: hil/study/chapters/_plants.pyi.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "foreign_law.hpp"
#include "quadrotor.hpp"
#include "vehicle5.hpp"
#include "vehicle6.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace chapters;

namespace {

nb::tuple names(std::initializer_list<const char*> list) {
  nb::list out;
  for (const char* name : list) out.append(name);
  return nb::tuple(out);
}

// A law of hil.control is used as it is, any other object by its methods.
class Seat {
 public:
  Seat(nb::handle law, int n) {
    if (nb::isinstance<control::Law>(law)) {
      law_ = nb::cast<control::Law*>(law);
      if (law_->dim() != n) throw std::invalid_argument("the law has another number of axes than its stage");
    } else {
      own_ = std::make_unique<ForeignLaw>(nb::borrow(law), n);
      law_ = own_.get();
    }
  }
  control::Law& law() { return *law_; }
  bool foreign() const { return own_ != nullptr; }

 private:
  control::Law* law_ = nullptr;
  std::unique_ptr<ForeignLaw> own_;
};

template <class Run>
Outcome unlocked(bool may_unlock, const Run& run) {
  std::optional<nb::gil_scoped_release> released;
  if (may_unlock) released.emplace();
  return run();
}

void bind_outcome(nb::module_& m) {
  nb::class_<Outcome>(m, "Outcome")
      .def_ro("ise", &Outcome::ise)
      .def_ro("ise_late", &Outcome::ise_late)
      .def_ro("worst_late", &Outcome::worst_late)
      .def_ro("worst_end", &Outcome::worst_end)
      .def_ro("cost_late", &Outcome::cost_late)
      .def_ro("effort", &Outcome::effort)
      .def_ro("effort_early", &Outcome::effort_early)
      .def_ro("peak_early", &Outcome::peak_early)
      .def_ro("peak_late", &Outcome::peak_late)
      .def_ro("peak", &Outcome::peak)
      .def_ro("tilt_late", &Outcome::tilt_late)
      .def_ro("integral_cost", &Outcome::integral_cost)
      .def_ro("rate_rms", &Outcome::rate_rms)
      .def_ro("s_max", &Outcome::s_max)
      .def_ro("end_s", &Outcome::end_s)
      .def_prop_ro("end",
                   [](const Outcome& out) {
                     const char* ends[] = {"complete", "tumbled", "diverged", "not finite"};
                     return ends[static_cast<int>(out.end)];
                   })
      .def_prop_ro(
          "samples",
          [](const Outcome& out) {
            auto* data = new std::vector<double>(out.samples);
            nb::capsule owner(data, [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
            return nb::ndarray<nb::numpy, double, nb::ndim<1>>(data->data(), {data->size()}, owner);
          },
          nb::rv_policy::automatic);
}

void bind_quadrotor(nb::module_& m) {
  nb::class_<Quadrotor>(m, "Quadrotor")
      .def(nb::init<>())
#define X(name) .def_rw(#name, &Quadrotor::name)
          QUADROTOR_PARAMETERS(X)
#undef X
      .def(
          "matrices",
          [](const Quadrotor& p, const Vec3& angle, const Vec3& rate) {
            const auto found = p.matrices(angle, rate);
            return std::pair(found.inertia, found.coriolis);
          },
          "angle_rad"_a, "rate_rad_s"_a)
      .def(
          "rates",
          [](const Quadrotor& p, const Quadrotor::State& x, double thrust, const Vec3& torque) {
            return p.rates(x, {thrust, torque}, {});
          },
          "state"_a, "thrust_n"_a, "torque_n_m"_a)
      .def(
          "step",
          [](const Quadrotor& p, const Quadrotor::State& x, double thrust, const Vec3& torque, double h) {
            const Quadrotor::Input input{thrust, torque};
            return rk4([&](double, const Quadrotor::State& y) { return p.rates(y, input, {}); }, 0.0, x, h);
          },
          "state"_a, "thrust_n"_a, "torque_n_m"_a, "dt_s"_a)
      .def("energy", &Quadrotor::energy, "state"_a)
      .def("reference", &Quadrotor::reference, "t_s"_a);
  m.def(
      "fly",
      [](const Quadrotor& plant, nb::handle position, nb::handle attitude, const std::vector<double>& draws) {
        Seat one(position, 3), two(attitude, 3);
        return unlocked(!one.foreign() && !two.foreign(),
                        [&] { return fly(plant, one.law(), two.law(), draws); });
      },
      "plant"_a, "position"_a, "attitude"_a, "draws"_a);
  m.attr("QUADROTOR_COLUMNS") = names(
      {"t_s", "x_m", "y_m", "z_m", "ref_x_m", "ref_y_m", "ref_z_m", "error_m", "ise_m2_s", "u2", "effort"});
}

void bind_vehicle5(nb::module_& m) {
  nb::class_<Vehicle5>(m, "Vehicle5")
      .def(nb::init<>())
#define X(name) .def_rw(#name, &Vehicle5::name)
          VEHICLE5_PARAMETERS(X)
#undef X
      .def(
          "rates",
          [](const Vehicle5& p, double t, const Vehicle5::State& x, const Vec3& torque) {
            return p.rates(p.gust(t), x, torque, {});
          },
          "t_s"_a, "state"_a, "torque"_a)
      .def(
          "step",
          [](const Vehicle5& p, double t, const Vehicle5::State& x, const Vec3& torque, double h) {
            return rk4(
                [&](double at, const Vehicle5::State& y) { return p.rates(p.gust(at), y, torque, {}); }, t, x,
                h);
          },
          "t_s"_a, "state"_a, "torque"_a, "dt_s"_a)
      .def("energy", &Vehicle5::energy, "state"_a)
      .def("reference", &Vehicle5::reference, "t_s"_a);
  m.def(
      "dive",
      [](const Vehicle5& plant, nb::handle position, nb::handle sideways, nb::handle drive) {
        Seat one(position, 3), two(sideways, 2), three(drive, 3);
        const bool native = !one.foreign() && !two.foreign() && !three.foreign();
        return unlocked(native, [&] { return dive(plant, one.law(), two.law(), three.law()); });
      },
      "plant"_a, "position"_a, "sideways"_a, "drive"_a);
  m.attr("VEHICLE5_COLUMNS") =
      names({"t_s", "x_m", "y_m", "z_m", "ref_x_m", "ref_y_m", "ref_z_m", "error_m", "ise_m2_s", "u_m_s",
             "v_m_s", "w_m_s", "q_rad_s", "r_rad_s", "tau_u_n", "tau_q_n_m", "tau_r_n_m"});
}

void bind_vehicle6(nb::module_& m) {
  nb::class_<Vehicle6>(m, "Vehicle6")
      .def(nb::init<>())
#define X(name) .def_rw(#name, &Vehicle6::name)
          VEHICLE6_PARAMETERS(X)
#undef X
      .def("coriolis", &Vehicle6::coriolis, "speed"_a)
      .def("damping", &Vehicle6::damping, "speed"_a)
      .def(
          "rates",
          [](const Vehicle6& p, double t, const Vehicle6::State& x, const Vec3& force) {
            return p.rates(p.gust(p.waves(0.0, t)), x, force);
          },
          "t_s"_a, "state"_a, "force_n"_a)
      .def(
          "step",
          [](const Vehicle6& p, double t, const Vehicle6::State& x, const Vec3& force, double h) {
            return rk4([&](double at,
                           const Vehicle6::State& y) { return p.rates(p.gust(p.waves(0.0, at)), y, force); },
                       t, x, h);
          },
          "t_s"_a, "state"_a, "force_n"_a, "dt_s"_a)
      .def("energy", &Vehicle6::energy, "state"_a)
      .def("reference", &Vehicle6::reference, "t_s"_a);
  m.def(
      "swim",
      [](const Vehicle6& plant, nb::handle position, const std::vector<double>& noise) {
        Seat one(position, 3);
        return unlocked(!one.foreign(), [&] { return swim(plant, one.law(), noise); });
      },
      "plant"_a, "position"_a, "noise"_a);
  m.attr("VEHICLE6_COLUMNS") = names({"t_s", "x_m", "y_m", "z_m", "ref_x_m", "ref_y_m", "ref_z_m", "error_m",
                                      "ise_m2_s", "cost_m", "u2", "s_m_s"});
}

}  // namespace

NB_MODULE(_plants, m) {
  nb::set_leak_warnings(false);               // values held by a test session at exit are no leak
  nb::module_::import_("hil.control._laws");  // its types are used here
  bind_outcome(m);
  bind_quadrotor(m);
  bind_vehicle5(m);
  bind_vehicle6(m);
#define X(name) #name,
  m.attr("QUADROTOR_PARAMETERS") = names({QUADROTOR_PARAMETERS(X)});
  m.attr("VEHICLE5_PARAMETERS") = names({VEHICLE5_PARAMETERS(X)});
  m.attr("VEHICLE6_PARAMETERS") = names({VEHICLE6_PARAMETERS(X)});
#undef X
}
