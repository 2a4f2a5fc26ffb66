// Python module hil.wire._wire; meaning and units for Python readers: hil/wire/link.py, hil/wire/framing.py.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <cstring>
#include <string>

#include "link.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using wire::FrameReader;
using wire::Link;
using wire::WheelReport;

std::string_view view(const nb::bytes& data) { return {data.c_str(), data.size()}; }

nb::bytes bytes_of(std::string_view data) { return nb::bytes(data.data(), data.size()); }

// The fields of a WHEEL_STATE in the order of the message.
// clang-format off
#define WHEEL_STATE_FIELDS(X)                                                                \
  X(t_mcu_us) X(left_counts) X(right_counts) X(omega_left_rad_s) X(omega_right_rad_s)        \
  X(error_rate_left_rad_s2) X(error_rate_right_rad_s2) X(s_left) X(s_right) X(t_setpoint_us) \
  X(pwm_left_counts) X(pwm_right_counts) X(setpoint_seq) X(state) X(reason) X(flags)
// clang-format on

nb::tuple fields_of(const mavlink_wheel_state_t& m) {
#define X(name) m.name,
  nb::object all = nb::make_tuple(WHEEL_STATE_FIELDS(X) nb::none());
#undef X
  return nb::borrow<nb::tuple>(all[nb::slice(nb::none(), nb::int_(-1), nb::none())]);
}

void bind_wheel_state(nb::module_& m) {
  nb::class_<mavlink_wheel_state_t> state(m, "WheelState");
  nb::list names;
#define X(name)                                      \
  state.def_ro(#name, &mavlink_wheel_state_t::name); \
  names.append(#name);
  WHEEL_STATE_FIELDS(X)
#undef X
  state.attr("FIELDS") = nb::tuple(names);
  state.def("__repr__", [](const mavlink_wheel_state_t& s) {
    return nb::str("WHEEL_STATE{}").format(nb::repr(fields_of(s)));
  });
  m.def(
      "wheel_state",
      [](const nb::bytes& frame) {
        return wire::payload_of<mavlink_wheel_state_t>(view(frame), MAVLINK_MSG_ID_WHEEL_STATE_LEN);
      },
      "frame"_a);
}

// (name, value, how many there are, index)
nb::tuple parameter_of(const nb::bytes& frame) {
  const auto m = wire::payload_of<mavlink_param_value_t>(view(frame), MAVLINK_MSG_ID_PARAM_VALUE_LEN);
  const std::size_t length = strnlen(m.param_id, sizeof(m.param_id));
  PyObject* name = PyUnicode_DecodeASCII(m.param_id, static_cast<Py_ssize_t>(length), "replace");
  if (name == nullptr) throw nb::python_error();
  return nb::make_tuple(nb::steal(name), m.param_value, m.param_count, m.param_index);
}

nb::object sample_of(const WheelReport& r) {
  static nb::object* make = nullptr;
  if (make == nullptr) make = new nb::object(nb::module_::import_("hil.core.types").attr("WheelSample"));
  return (*make)(r.t_board_s, r.wire.left_counts, r.wire.right_counts, r.wire.omega_left_rad_s,
                 r.wire.omega_right_rad_s);
}

nb::tuple fields_of(const WheelReport& r) {
  return nb::make_tuple(r.t_arrival_s, r.t_board_s, r.round_trip_s, fields_of(r.wire));
}

void bind_report(nb::module_& m) {
  nb::class_<WheelReport>(m, "WheelReport")
      .def_ro("t_arrival_s", &WheelReport::t_arrival_s)
      .def_ro("t_board_s", &WheelReport::t_board_s)
      .def_ro("round_trip_s", &WheelReport::round_trip_s)
      .def_prop_ro(
          "wire", [](const WheelReport& r) -> const mavlink_wheel_state_t& { return r.wire; },
          nb::rv_policy::reference_internal)
      .def_prop_ro("sample", &sample_of)
      .def("__eq__",
           [](const WheelReport& a, const WheelReport& b) { return fields_of(a).equal(fields_of(b)); })
      .def("__repr__",
           [](const WheelReport& r) { return nb::str("WheelReport{}").format(nb::repr(fields_of(r))); });
}

nb::list fed(FrameReader& reader, const nb::bytes& data) {
  nb::list out;
  reader.feed(view(data), [&out](std::string_view frame) {
    out.append(nb::make_tuple(wire::message_id(frame), bytes_of(frame)));
  });
  return out;
}

// (new reports, frames of other messages with their ids)
nb::tuple taken(Link& link, const nb::bytes& data, double t_s, const nb::object& tap) {
  std::vector<WheelReport> found;
  nb::list others;
  link.take(
      view(data), t_s, found,
      [&](std::string_view frame) {
        if (!tap.is_none()) tap(t_s, bytes_of(frame));
      },
      [&](std::string_view frame) {
        others.append(nb::make_tuple(wire::message_id(frame), bytes_of(frame)));
      });
  nb::list reports;
  for (const WheelReport& report : found) reports.append(nb::cast(report));
  return nb::make_tuple(reports, others);
}

nb::list timer_frames(Link& link, double t_s) {
  nb::list out;
  link.run_timers(t_s, [&out](const std::string& frame) { out.append(bytes_of(frame)); });
  return out;
}

void bind_link(nb::module_& m) {
  using wire::FrameWriter;
  using wire::ReadCounters;
  nb::class_<ReadCounters>(m, "ReadCounters")
      .def_ro("frames", &ReadCounters::frames)
      .def_ro("lost", &ReadCounters::lost)
      .def_ro("bad_crc", &ReadCounters::bad_crc)
      .def_ro("skipped_bytes", &ReadCounters::skipped_bytes)
      .def_ro("foreign", &ReadCounters::foreign)
      .def_ro("signed_frames", &ReadCounters::signed_frames);
  nb::class_<FrameReader>(m, "FrameReader")
      .def(nb::init<std::uint8_t>(), "system"_a)
      .def("feed", &fed, "data"_a)
      .def_ro("counters", &FrameReader::counters, nb::rv_policy::reference_internal);
  nb::class_<FrameWriter>(m, "FrameWriter")
      .def(nb::init<std::uint8_t, std::uint8_t>(), "system"_a, "component"_a)
      .def_prop_ro("seq", &FrameWriter::seq)
      .def("count", &FrameWriter::count)
      .def(
          "parameter_request",
          [](FrameWriter& w, std::int16_t index) { return bytes_of(w.parameter_request(index)); }, "index"_a)
      .def(
          "setpoint",
          [](FrameWriter& w, double left, double right, std::uint16_t seq) {
            return bytes_of(w.setpoint(static_cast<float>(left), static_cast<float>(right), seq));
          },
          "left_rad_s"_a, "right_rad_s"_a, "seq"_a);
  nb::class_<Link>(m, "Link")
      .def(nb::init<>())
      .def_ro("clock", &Link::clock, nb::rv_policy::reference_internal)
      .def_ro("writer", &Link::writer, nb::rv_policy::reference_internal)
      .def_prop_ro(
          "counters", [](const Link& l) -> const ReadCounters& { return l.reader.counters; },
          nb::rv_policy::reference_internal)
      .def_ro("state", &Link::state)
      .def_ro("reason", &Link::reason)
      .def_ro("heartbeats", &Link::heartbeats)
      .def_rw("frames_sent", &Link::frames_sent)
      .def_ro("battery_v", &Link::battery_v)
      .def_prop_ro("sys_status", [](const Link& l) { return bytes_of(l.sys_status); })
      .def("forget_sys_status", [](Link& l) { l.sys_status.clear(); })
      .def("take", &taken, "data"_a, "t_s"_a, "tap"_a.none())
      .def(
          "setpoint",
          [](Link& l, double t_s, double left, double right) {
            return bytes_of(l.setpoint(t_s, left, right));
          },
          "t_s"_a, "left_rad_s"_a, "right_rad_s"_a)
      .def("rest_until", &Link::rest_until, "until_s"_a)
      .def("due", &Link::due, "t_s"_a)
      .def("timer_frames", &timer_frames, "t_s"_a)
      .def("ask_time", [](Link& l, double t_s) { return bytes_of(l.ask_time(t_s)); }, "t_s"_a);
}

}  // namespace

NB_MODULE(_wire, m) {
  nb::set_leak_warnings(false);              // values held by a test session at exit are no leak
  nb::module_::import_("hil.core._native");  // the type of Link.clock
  m.def(
      "checksum", [](const nb::bytes& data, std::uint8_t extra) { return wire::checksum(view(data), extra); },
      "data"_a, "extra"_a);
  m.def("parameter", &parameter_of, "frame"_a);
  bind_wheel_state(m);
  bind_report(m);
  bind_link(m);
}
