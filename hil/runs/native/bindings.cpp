// Python module hil.runs._native; meaning and units for Python readers: hil/runs/_native.pyi.
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <vector>

#include "estimate_made.hpp"
#include "pump.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using runs::Agreement;
using runs::Command;
using runs::Motion;
using runs::Plausibility;
using runs::Pump;
using runs::Seen;
using runs::Watch;
using runs::WheelLimits;
using Stops = std::array<bool, runs::kReactionCount>;

runs::Note note_of(const nb::object& note) {
  return [note](const char* kind, const std::string& text) { note(kind, text); };
}

double number(nb::handle object, const char* name) { return nb::cast<double>(object.attr(name)); }

// An Estimate or a Truth as the rows have it.
Motion motion_of(nb::handle state) {
  const nb::object pose = state.attr("pose"), z1 = state.attr("z1_m");
  return {number(pose, "x_m"),
          number(pose, "y_m"),
          number(pose, "theta_rad"),
          number(state, "eta1_m_s"),
          number(state, "theta_dot_rad_s"),
          nb::cast<double>(z1[0]),
          nb::cast<double>(z1[1])};
}

// Terms of a law's trace in the order of a record's columns; NaN for those that it does not have.
class Terms {
 public:
  explicit Terms(const nb::tuple& keys) : keys_(keys) {}
  template <typename Put>
  void put(const nb::object& trace, std::size_t from, std::size_t to, Put put) const {
    for (std::size_t i = from; i < to; ++i) {
      const nb::object value = trace.attr("get")(keys_[i], runs::kNone);
      put(nb::cast<double>(nb::float_(value)));
    }
  }
  template <typename Put>
  void put_dict(PyObject* trace, std::size_t from, std::size_t to, Put put) const {
    for (std::size_t i = from; i < to; ++i) {
      PyObject* value = PyDict_GetItem(trace, nb::handle(keys_[i]).ptr());
      if (value == nullptr) {
        put(runs::kNone);
        continue;
      }
      const double found = PyFloat_AsDouble(value);
      if (found == -1.0 && PyErr_Occurred() != nullptr) throw nb::python_error();
      put(found);
    }
  }
  template <typename Put>
  void both(const nb::object& trace, std::size_t from, std::size_t to, Put put_value) const {
    if (PyDict_Check(trace.ptr())) {
      put_dict(trace.ptr(), from, to, put_value);
    } else {
      put(trace, from, to, put_value);
    }
  }
  std::size_t size() const { return keys_.size(); }

 private:
  nb::tuple keys_;
};

// A tick's row: `keys` are those of the law's trace that every record has, then those that this law adds.
struct RowFormat {
  Terms terms;
  std::size_t common;
};

struct Tick {
  double now_s, t_s;
  nb::tuple goal_m;
  nb::object trace;
  Command command;
  bool late;
};

nb::tuple row_of(Watch& watch, const RowFormat& format, const wire::Link& link, const Tick& tick,
                 const Motion* estimate, const Motion* truth) {
  std::vector<double> values;
  values.reserve(64 + format.terms.size());
  const auto put = [&values](double value) { values.push_back(value); };
  watch.row(tick.now_s, tick.t_s, estimate, truth, nb::cast<double>(tick.goal_m[0]),
            nb::cast<double>(tick.goal_m[1]), tick.command, link, tick.late, put,
            [&](auto put_term) { format.terms.both(tick.trace, 0, format.common, put_term); });
  format.terms.both(tick.trace, format.common, format.terms.size(), put);
  PyObject* row = PyTuple_New(static_cast<Py_ssize_t>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i) {
    PyTuple_SET_ITEM(row, static_cast<Py_ssize_t>(i), PyFloat_FromDouble(values[i]));
  }
  return nb::steal<nb::tuple>(row);
}

Tick tick_of(double now_s, double t_s, const nb::tuple& goal_m, nb::handle command, const nb::tuple& wheels,
             bool late) {
  return {now_s,
          t_s,
          goal_m,
          nb::object(command.attr("trace")),
          {number(command, "eta1_m_s"), number(command, "theta_dot_rad_s"), nb::cast<double>(wheels[0]),
           nb::cast<double>(wheels[1])},
          late};
}

void bind_plausibility(nb::module_& m) {
  nb::list names;
  for (const char* name : runs::kReactions) names.append(name);
  m.attr("REACTIONS") = nb::tuple(names);
  nb::class_<Plausibility>(m, "Plausibility")
      .def(
          "__init__",
          [](Plausibility* self, const Stops& stops, const nb::object& note) {
            new (self) Plausibility(stops, note_of(note));
          },
          "stops"_a, "note"_a)
      .def(
          "saw",
          [](Plausibility& p, const nb::bytes& picture, const nb::object& counts, double rad_per_count) {
            runs::Counts now{};
            if (!counts.is_none()) now = nb::cast<runs::Counts>(counts);
            p.saw(std::string(picture.c_str(), picture.size()), counts.is_none() ? nullptr : &now,
                  rad_per_count);
          },
          "picture"_a, "counts"_a.none(), "rad_per_count"_a)
      .def("check", &Plausibility::check, "now_s"_a, "given_rad_s"_a, "pwm_counts"_a, "pwm_top_counts"_a)
      .def("asked", &Plausibility::asked, "left_rad_s"_a, "right_rad_s"_a)
      .def("check_progress", &Plausibility::check_progress, "now_s"_a, "error_m"_a)
      .def("finish", &Plausibility::finish);
  m.def("side_at_limit", &WheelLimits::side, "pwm_counts"_a, "lacks_rad_s"_a, "most_counts"_a);
  m.def("driven_hard", &WheelLimits::driven_hard, "left_pwm_counts"_a, "right_pwm_counts"_a,
        "stall_counts"_a);
  m.def("odd_stamp", &runs::odd_stamp, "ahead_s"_a);
  nb::class_<RowFormat>(m, "RowFormat")
      .def(
          "__init__",
          [](RowFormat* self, const nb::tuple& common, const nb::tuple& own) {
            new (self) RowFormat{Terms(nb::borrow<nb::tuple>(common + own)), common.size()};
          },
          "common"_a, "own"_a);
}

void bind_watch(nb::module_& m) {
  nb::class_<Watch>(m, "Watch")
      .def(
          "__init__",
          [](Watch* self, const std::array<double, 4>& fence, double link_lost_s, double pose_lost_s,
             const Stops& stops, const nb::object& note, double uplink_s, double rad_per_count) {
            new (self) Watch({fence[0], fence[1], fence[2], fence[3], link_lost_s, pose_lost_s}, stops,
                             note_of(note), uplink_s, rad_per_count);
          },
          nb::kw_only(), "fence_m"_a, "link_lost_s"_a, "pose_lost_s"_a, "stops"_a, "note"_a, "uplink_s"_a,
          "rad_per_count"_a)
      .def_ro("uplink_s", &Watch::uplink_s)
      .def_ro("poses", &Watch::poses)
      .def_prop_ro("reason",
                   [](const Watch& w) -> nb::object {
                     return w.has_frame ? nb::object(nb::str(w.why_not_seen.c_str())) : nb::none();
                   })
      .def_rw("camera_latency_s", &Watch::camera_latency_s)
      .def(
          "check_clock", [](Watch& w, double now_s) { w.supervisor.check_clock(now_s); }, "now_s"_a)
      .def(
          "check_host", [](Watch& w, double now_s) { w.supervisor.check_host(now_s); }, "now_s"_a)
      .def(
          "check_estimate", [](Watch& w, double x_m, double y_m) { w.supervisor.check_estimate(x_m, y_m); },
          "x_m"_a, "y_m"_a)
      .def("take_report", &Watch::take_report, "report"_a)
      .def(
          "take_frame",
          [](Watch& w, double exposure_s, const nb::object& pose, double quality, const std::string& reason,
             const nb::bytes& picture, bool believed, double agreement_age_s) {
            core::PoseFrame said;
            said.quality = quality;
            said.seen = !pose.is_none();
            if (said.seen) {
              said.x_m = number(pose, "x_m");
              said.y_m = number(pose, "y_m");
            }
            w.take_frame(said, exposure_s, reason, std::string(picture.c_str(), picture.size()), believed,
                         agreement_age_s);
          },
          nb::kw_only(), "exposure_s"_a, "pose"_a.none(), "quality"_a, "reason"_a, "picture"_a, "believed"_a,
          "agreement_age_s"_a)
      .def(
          "check",
          [](Watch& w, double now_s, double age_s, const std::array<double, 3>& refused,
             const std::array<double, 2>& scales,
             std::int64_t pwm_top_counts) { w.check(now_s, {age_s, refused, scales}, pwm_top_counts); },
          "now_s"_a, "agreement_age_s"_a, "refused"_a, "scales"_a, "pwm_top_counts"_a)
      .def(
          "sides",
          [](const Watch& w, double most_counts) {
            const auto sides = w.sides(most_counts);
            return nb::make_tuple(sides[0], sides[1]);
          },
          "most_counts"_a)
      .def("driven_hard", &Watch::driven_hard, "stall_counts"_a)
      .def(
          "take_tick",
          [](Watch& w, double now_s, double dt_s, const std::array<int, 2>& sides, double asked_rad_s,
             double made_rad_s, double left_rad_s, double right_rad_s, double error_m) {
            w.take_tick(now_s, dt_s, sides, {0.0, asked_rad_s, left_rad_s, right_rad_s}, made_rad_s, error_m);
          },
          "now_s"_a, "dt_s"_a, "sides"_a, "asked_rad_s"_a, "made_rad_s"_a, "left_rad_s"_a, "right_rad_s"_a,
          "error_m"_a)
      .def(
          "row",
          [](Watch& w, const RowFormat& format, const wire::Link& link, double now_s, double t_s,
             const nb::object& estimate, const nb::object& truth, const nb::tuple& goal_m, nb::handle command,
             const nb::tuple& wheels, bool late) {
            Motion est, real;
            if (!estimate.is_none()) est = motion_of(estimate);
            if (!truth.is_none()) real = motion_of(truth);
            return row_of(w, format, link, tick_of(now_s, t_s, goal_m, command, wheels, late),
                          estimate.is_none() ? nullptr : &est, truth.is_none() ? nullptr : &real);
          },
          "format"_a, "link"_a, "now_s"_a, "t_s"_a, "estimate"_a.none(), "truth"_a.none(), "goal_m"_a,
          "command"_a, "wheels_rad_s"_a, "late"_a)
      .def("finish", [](Watch& w) { w.plausibility.finish(); })
      .def("short_turn", [](const Watch& w) { return w.limits.verdict(); });
}

// An Estimate as its constructor would make it; the class is frozen, and its constructor slow for that.
const hil::EstimateClass& estimates() {
  static const hil::EstimateClass* made =
      new hil::EstimateClass();  // never freed: the interpreter ends first
  return *made;
}

nb::object look(Pump& pump, Watch& watch, double now_s, double most_counts, double stall_counts) {
  const estimator::State& s = pump.look(now_s, most_counts);
  const std::array<int, 2> sides = pump.sides();
  return estimates().of(
      {now_s + watch.uplink_s, s.pose.x_m, s.pose.y_m, s.pose.theta_rad, s.eta1_m_s, s.theta_dot_rad_s},
      nb::make_tuple(s.z1_m[0], s.z1_m[1]), nb::make_tuple(s.z2_m_s[0], s.z2_m_s[1]), nb::none(),
      nb::make_tuple(sides[0], sides[1]), watch.driven_hard(stall_counts));
}

nb::list others_of(Pump& pump) {
  nb::list out;
  for (const auto& [id, frame] : pump.others)
    out.append(nb::make_tuple(id, nb::bytes(frame.data(), frame.size())));
  return out;
}

// Frames as hil.record.schema.FRAME_NAMES has them, t = 0 at origin_s, one double a value.
nb::bytes frame_rows(const Pump& pump, double origin_s) {
  constexpr std::size_t kWidth = 21;
  std::vector<double> out(pump.frames.size() * kWidth, runs::kNone);
  double* row = out.data();
  for (const Pump::FrameRow& f : pump.frames) {
    const double t_s = f.t_arrival_s - origin_s, none = runs::kNone;
    const double known[] = {t_s,
                            t_s - f.latency_s,
                            f.t_cam_s,
                            static_cast<double>(f.index),
                            f.seen ? 1.0 : 0.0,
                            f.seen ? f.x_m : none,
                            f.seen ? f.y_m : none,
                            f.seen ? f.theta_rad : none,
                            f.quality,
                            f.sigma_xy_m,
                            f.sigma_theta_rad};
    double* rest = std::copy(std::begin(known), std::end(known), row);
    rest = std::copy(f.covariance.begin(), f.covariance.end(), rest);
    std::copy(f.marks.begin(), f.marks.end(), rest);
    row += kWidth;
  }
  return nb::bytes(reinterpret_cast<const char*>(out.data()), out.size() * sizeof(double));
}

core::SimulatedRig& rig_of(const nb::capsule& handle) {
  if (std::strcmp(handle.name(), core::kSimulatedRig) != 0)
    throw nb::type_error("not a simulated rig's handle");
  return *static_cast<core::SimulatedRig*>(handle.data());
}

// What an eye in Python says (hil/runs/watching.py): pose or None, quality, sigmas, reason; then what is known of the
// covariance besides the sigmas, the covariance itself, and the marks, each None where it is not.
Seen seen_of(const nb::tuple& said) {
  Seen seen;
  const auto take = [&said](std::size_t place, auto& values) {
    if (!said[place].is_none()) values = nb::cast<std::decay_t<decltype(values)>>(said[place]);
  };
  seen.said.seen = !said[0].is_none();
  std::array<double, 3> pose{};
  take(0, pose);
  seen.said.x_m = pose[0];
  seen.said.y_m = pose[1];
  seen.said.theta_rad = pose[2];
  seen.said.quality = nb::cast<double>(said[1]);
  seen.said.sigma_xy_m = nb::cast<double>(said[2]);
  seen.said.sigma_theta_rad = nb::cast<double>(said[3]);
  seen.reason = nb::cast<std::string>(said[4]);
  take(5, seen.excess);
  take(6, seen.covariance);
  take(7, seen.marks);
  return seen;
}

runs::Eye eye_of(const nb::object& eye) {
  return [eye](const std::optional<estimator::State>& expected) {
    nb::object pose = nb::none();
    if (expected) pose = nb::make_tuple(expected->pose.x_m, expected->pose.y_m, expected->pose.theta_rad);
    return seen_of(nb::cast<nb::tuple>(eye(pose)));
  };
}

void bind_pump(nb::module_& m) {
  nb::class_<Pump>(m, "Pump")
      .def(
          "__init__",
          [](Pump* self, const nb::capsule& rig, wire::Link& link, core::CameraClock& camera,
             estimator::Fused& fused, Watch& watch, const nb::object& note, const nb::object& eye) {
            new (self) Pump(rig_of(rig), link, camera, fused, watch, note_of(note), eye_of(eye));
          },
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(),
          nb::keep_alive<1, 6>(), "rig"_a, "link"_a, "camera"_a, "fused"_a, "watch"_a, "note"_a, "eye"_a)
      .def(
          "begin",
          [](Pump& p, double until_s, bool busy) { return static_cast<int>(p.begin(until_s, busy)); },
          "until_s"_a, "busy"_a)
      .def(
          "begin_periods",
          [](Pump& p, double period_s, double last_s) {
            return static_cast<int>(p.begin_periods(period_s, last_s));
          },
          "period_s"_a, "last_s"_a)
      .def(
          "go_on", [](Pump& p, bool busy) { return static_cast<int>(p.go_on(busy)); }, "busy"_a)
      .def_prop_ro("now_s", &Pump::now_s)
      .def("others", &others_of)
      .def("frame_rows", &frame_rows, "origin_s"_a)
      .def(
          "check",
          [](const Pump& p, Watch& watch, double now_s, std::int64_t pwm_top_counts) {
            watch.check(now_s, p.agreement(now_s), pwm_top_counts);
          },
          "watch"_a, "now_s"_a, "pwm_top_counts"_a)
      .def("look", &look, "watch"_a, "now_s"_a, "most_counts"_a, "stall_counts"_a)
      .def(
          "act",
          [](Pump& p, Watch& watch, const RowFormat& format, double now_s, double t_s, double dt_s,
             const nb::tuple& looked_goal_m, const nb::tuple& goal_m, nb::handle command,
             const nb::tuple& wheels, bool late) {
            const Tick tick = tick_of(now_s, t_s, goal_m, command, wheels, late);
            p.act(now_s, dt_s, tick.command, nb::cast<double>(looked_goal_m[0]),
                  nb::cast<double>(looked_goal_m[1]));
            const auto estimate = p.estimate(now_s);
            const Motion truth = p.truth();
            return row_of(watch, format, p.link(), tick, estimate ? &*estimate : nullptr, &truth);
          },
          "watch"_a, "format"_a, "now_s"_a, "t_s"_a, "dt_s"_a, "looked_goal_m"_a, "goal_m"_a, "command"_a,
          "wheels_rad_s"_a, "late"_a)
      .def_prop_ro("rig_now_s", &Pump::rig_now_s)
      .def(
          "send_setpoint",
          [](Pump& p, double t_s, double left_rad_s, double right_rad_s) {
            p.send_setpoint(t_s, left_rad_s, right_rad_s);
          },
          "t_s"_a, "left_rad_s"_a, "right_rad_s"_a);
  m.attr("REACHED") = static_cast<int>(Pump::kReached);
  m.attr("HEARD") = static_cast<int>(Pump::kHeard);
  m.attr("TAKEN") = static_cast<int>(Pump::kTaken);
}

}  // namespace

void bind_drive(nb::module_& m);     // drive_bind.cpp
void bind_together(nb::module_& m);  // together_bind.cpp

NB_MODULE(_native, m) {
  nb::set_leak_warnings(false);  // values held by a test session at exit are no leak
  for (const char* name :
       {"hil.core._native", "hil.wire._wire", "hil.control.estimators._fused", "hil.control._outer"}) {
    nb::module_::import_(name);  // the types of what is handed in here
  }
  bind_plausibility(m);
  bind_watch(m);
  bind_pump(m);
  bind_drive(m);
  bind_together(m);
}
