// Python module hil.control._outer; meaning and units for Python readers: hil/control/_outer.pyi.
#include <nanobind/nanobind.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <string>

#include "outer_laws.hpp"
#include "python_law.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using outer::Estimate;
using outer::OuterLaw;
using outer::Reference;
using outer::ReferenceState;

template <typename T>
void take(nb::handle from, T& out);

// Fills the fields of a C++ value from the attributes of the same names.
struct Filled {
  nb::handle from;
  template <typename T>
  void operator()(const char* name, T& out) const {
    take(from.attr(name), out);
  }
};

template <typename T, typename = void>
struct Taken {
  static void take(nb::handle from, T& out) { outer::fields(out, Filled{from}); }
};
template <typename T>
struct Taken<T, std::enable_if_t<std::is_arithmetic_v<T> || std::is_same_v<T, std::string>>> {
  static void take(nb::handle from, T& out) { out = nb::cast<T>(from); }
};
template <typename T>
struct Taken<std::tuple<T, T>> {
  static void take(nb::handle from, std::tuple<T, T>& out) {
    out = {nb::cast<T>(from[0]), nb::cast<T>(from[1])};
  }
};
template <typename T>
struct Taken<outer::Opt<T>> {
  static void take(nb::handle from, outer::Opt<T>& out) {
    out = outer::Opt<T>{};
    if (from.is_none()) return;
    T value{};
    Taken<T>::take(from, value);
    out = value;
  }
};

template <typename T>
void take(nb::handle from, T& out) {
  Taken<T>::take(from, out);
}

template <typename T>
T taken(nb::handle from) {
  T out{};
  take(from, out);
  return out;
}

nb::object pair(const outer::Vec2& v) { return nb::make_tuple(std::get<0>(v), std::get<1>(v)); }

// A law on a sliding block is given one that leaves the same parts out; any other has none.
template <typename Law, typename = void>
struct Block {
  static void leave_out(Law&, bool, bool) {}
};
template <typename Law>
struct Block<Law, std::void_t<decltype(&Law::_block)>> {
  static void leave_out(Law& law, bool kappa, bool gamma) { law._block.leave_out(kappa, gamma); }
};

template <typename Law, typename Gains>
std::unique_ptr<OuterLaw> made(nb::handle gains, nb::handle limits, double d0_m, bool kappa, bool gamma) {
  auto law = std::make_unique<Law>(taken<Gains>(gains), taken<outer::OuterLimits>(limits), d0_m);
  Block<Law>::leave_out(*law, kappa, gamma);
  return law;
}

std::unique_ptr<OuterLaw> law_of(const std::string& name, nb::handle gains, nb::handle limits, double d0_m,
                                 bool kappa, bool gamma) {
#define X(Law, Gains) \
  if (name == #Law) return made<outer::Law, outer::Gains>(gains, limits, d0_m, kappa, gamma);
  OUTER_LAWS(X)
#undef X
  throw nb::key_error(("no law of the class " + name).c_str());
}

outer::Waypoints waypoints_of(nb::handle path) {
  outer::Waypoints out;
  out._length = nb::cast<double>(path.attr("_length"));
  out.duration_s = nb::cast<double>(path.attr("duration_s"));
  out._knots = nb::cast<std::vector<double>>(path.attr("_knots"));
  for (nb::handle piece : path.attr("_pieces")) {
    out._pieces.emplace_back(nb::cast<double>(piece[0]), nb::cast<std::vector<double>>(piece[1]),
                             nb::cast<std::vector<double>>(piece[2]));
  }
  return out;
}

std::unique_ptr<Reference> stops_of(nb::handle path) {
  auto out = std::make_unique<outer::Stops>();
  out->_begins_s = nb::cast<std::vector<double>>(path.attr("_begins_s"));
  for (nb::handle leg : path.attr("_legs")) out->_legs.push_back(waypoints_of(leg));
  return out;
}

void bind_laws(nb::module_& m) {
  nb::class_<OuterLaw>(m, "OuterLaw")
      .def(
          "reset",
          [](OuterLaw& law, nb::handle reference, nb::handle estimate) {
            law.reset(taken<ReferenceState>(reference), taken<Estimate>(estimate));
          },
          "reference"_a, "estimate"_a)
      .def(
          "step",
          [](OuterLaw& law, nb::handle reference, nb::handle estimate, double dt_s, const nb::tuple& own) {
            const outer::OuterCommand out =
                law.step(taken<ReferenceState>(reference), taken<Estimate>(estimate), dt_s);
            nb::dict trace;
            for (std::size_t key = 0; key < outer::kTraceSize; ++key) {
              trace[outer::kTraceKeys[key]] = out.trace.get(key);
            }
            for (std::size_t i = 0; i < own.size() && outer::kTraceSize + i < outer::kTraceSlots; ++i) {
              trace[own[i]] = out.trace.get(outer::kTraceSize + i);
            }
            return nb::make_tuple(out.eta1_m_s, out.theta_dot_rad_s, trace);
          },
          "reference"_a, "estimate"_a, "dt_s"_a, "own"_a = nb::tuple());
  using Law = std::unique_ptr<OuterLaw>;
  m.def(
      "python_law",
      [](const nb::object& law, const nb::tuple& own) -> Law {
        return std::make_unique<PythonLaw>(law, own);
      },
      "law"_a, "own"_a);
  m.def("law", &law_of, "name"_a, "gains"_a, "limits"_a, "d0_m"_a, nb::kw_only(), "without_kappa"_a = false,
        "without_gamma"_a = false);
  m.def(
      "without_feed_forward",
      [](OuterLaw& law) -> Law { return std::make_unique<outer::WithoutFeedForward>(outer::AnyLaw{&law}); },
      nb::keep_alive<0, 1>(), "law"_a);
  m.def(
      "hold_at_goal",
      [](OuterLaw& law, double enter_m, double leave_m) -> Law {
        outer::OuterLimits limits;
        limits.hold_enter_m = enter_m;
        limits.hold_leave_m = leave_m;
        return std::make_unique<outer::HoldAtGoal>(outer::AnyLaw{&law}, limits);
      },
      nb::keep_alive<0, 1>(), "law"_a, "enter_m"_a, "leave_m"_a);
  m.def(
      "within_wheel_speed",
      [](OuterLaw& law, nb::handle geometry, double omega_max_rad_s) -> Law {
        return std::make_unique<outer::WithinWheelSpeed>(
            outer::AnyLaw{&law}, taken<outer::BelievedGeometry>(geometry), omega_max_rad_s);
      },
      nb::keep_alive<0, 1>(), "law"_a, "geometry"_a, "omega_max_rad_s"_a);
  m.def(
      "turn_first",
      [](OuterLaw& law, nb::handle missing_rad_s) -> Law {
        return std::make_unique<outer::TurnFirst>(outer::AnyLaw{&law},
                                                  taken<outer::Opt<double>>(missing_rad_s));
      },
      nb::keep_alive<0, 1>(), "law"_a, "missing_rad_s"_a.none());
  m.def(
      "turned_axes",
      [](OuterLaw& law, double angle_rad, const outer::m::Pairs& more) -> Law {
        for (const auto& [x, y] : more) {
          if (x >= outer::kTraceSlots || y >= outer::kTraceSlots)
            throw nb::value_error("no place of a trace");
        }
        auto out = std::make_unique<outer::TurnedAxes>(outer::AnyLaw{&law}, angle_rad);
        out->pairs.insert(out->pairs.end(), more.begin(), more.end());
        return out;
      },
      nb::keep_alive<0, 1>(), "law"_a, "angle_rad"_a, "more"_a);
  m.def(
      "let_go",
      [](OuterLaw& law, nb::handle geometry, nb::handle least_rad_s) -> Law {
        return std::make_unique<outer::LetGo>(outer::AnyLaw{&law}, taken<outer::BelievedGeometry>(geometry),
                                              taken<outer::Opt<double>>(least_rad_s));
      },
      nb::keep_alive<0, 1>(), "law"_a, "geometry"_a, "least_rad_s"_a.none());
}

void bind_references(nb::module_& m) {
  nb::class_<Reference>(m, "Reference")
      .def(
          "at",
          [](Reference& reference, double t_s) {
            const ReferenceState state = reference.at(t_s);
            return nb::make_tuple(pair(state.z1_m), pair(state.z1_dot_m_s), pair(state.z1_ddot_m_s2),
                                  pair(state.z1_dddot_m_s3));
          },
          "t_s"_a);
  using Made = std::unique_ptr<Reference>;
  m.def(
      "point",
      [](nb::handle state) -> Made {
        auto out = std::make_unique<outer::Point>();
        take(state, out->_state);
        return out;
      },
      "state"_a);
  m.def(
      "circle",
      [](nb::handle config) -> Made {
        return std::make_unique<outer::Circle>(taken<outer::CircleReference>(config));
      },
      "config"_a);
  m.def(
      "waypoints",
      [](nb::handle path) -> Made { return std::make_unique<outer::Waypoints>(waypoints_of(path)); },
      "path"_a);
  m.def("stops", &stops_of, "path"_a);
}

}  // namespace

NB_MODULE(_outer, m) {
  nb::set_leak_warnings(false);  // values held by a test session at exit are no leak
  nb::register_exception_translator(
      [](const std::exception_ptr& thrown, void*) {
        try {
          std::rethrow_exception(thrown);
        } catch (const outer::PythonError& error) {
          PyObject* const kinds[] = {PyExc_ZeroDivisionError, PyExc_ValueError, PyExc_OverflowError,
                                     PyExc_TypeError};
          PyErr_SetString(kinds[error.kind], error.what());
        }
      },
      nullptr);
  nb::list names, laws, sources;
  for (const char* key : outer::kTraceKeys) names.append(key);
  for (const auto& [path, hash] : outer::kSources) sources.append(nb::make_tuple(path, hash));
  for (const char* law : outer::kLaws) laws.append(law);
  m.attr("TRACE_KEYS") = nb::tuple(names);
  m.attr("LAWS") = nb::tuple(laws);
  m.attr("OWN_TERMS_MOST") = static_cast<int>(outer::kTraceSlots - outer::kTraceSize);
  m.attr("SOURCES") = nb::tuple(sources);
  bind_laws(m);
  bind_references(m);
}
