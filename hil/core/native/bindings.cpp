// Python module hil.core._native; meaning and units for Python readers: hil/core/clocks.py, hil/core/rig.py.
#include <nanobind/nanobind.h>

#include "backlog.hpp"
#include "clocks.hpp"
#include "exact.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

// What native code throws becomes what Python code catches, in every module.
void faults_as_python(nb::module_& m) {
  m.attr("_RigFault") = nb::module_::import_("hil.core.errors").attr("RigFault");
  nb::register_exception_translator(
      [](const std::exception_ptr& thrown, void* type) {
        try {
          std::rethrow_exception(thrown);
        } catch (const core::RigFault& fault) {
          PyErr_SetString(static_cast<PyObject*>(type), fault.what());
        }
      },
      m.attr("_RigFault").ptr());
}

}  // namespace

NB_MODULE(_native, m) {
  nb::set_leak_warnings(false);  // values held by a test session at exit are no leak
  using core::BoardClock;
  using core::CameraClock;
  nb::class_<BoardClock>(m, "BoardClock")
      .def(nb::init<int, double>(), "window"_a = 64, "rtt_limit_s"_a = 0.5)
      .def_ro("exchanges", &BoardClock::exchanges)
      .def_ro("refused", &BoardClock::refused)
      .def_ro("restarts", &BoardClock::restarts)
      .def_ro("rtt_s", &BoardClock::rtt_s)
      .def_ro("bound_s", &BoardClock::bound_s)
      .def_prop_ro("ready", &BoardClock::ready)
      .def_prop_ro("drift_ratio", &BoardClock::drift_ratio)
      .def_prop_ro("sigma_s", &BoardClock::sigma_s)
      .def("exchange", &BoardClock::exchange, "t_send_s"_a, "t_receive_s"_a, "t_mcu_us"_a)
      .def("report", &BoardClock::report, "t_mcu_us"_a, "t_arrival_s"_a)
      .def("to_host_s", &BoardClock::to_host_s, "t_mcu_us"_a);
  nb::class_<CameraClock>(m, "CameraClock")
      .def(nb::init<double, int>(), "latency_s"_a, "window"_a = 301)
      .def_ro("refused", &CameraClock::refused)
      .def_ro("restarts", &CameraClock::restarts)
      .def_ro("step_s", &CameraClock::step_s)
      .def_prop_ro("ready", &CameraClock::ready)
      .def_prop_ro("sigma_s", &CameraClock::sigma_s)
      .def("arrival", &CameraClock::arrival, "t_cam_s"_a, "t_host_s"_a)
      .def("to_host_s", &CameraClock::to_host_s, "t_cam_s"_a);
  using core::LineBacklog;
  faults_as_python(m);
  m.attr("PORT_BYTES") = static_cast<int>(LineBacklog::kPortBytes);
  nb::class_<LineBacklog>(m, "LineBacklog")
      .def(nb::init<int>(), "baud"_a)
      .def("waiting_bytes", &LineBacklog::waiting_bytes, "t_s"_a)
      .def(
          "write", [](LineBacklog& line, double t_s, std::int64_t size) { line.write(t_s, size); }, "t_s"_a,
          "size"_a)
      .def("clear", &LineBacklog::clear);
  m.def("hypot", &core::hypot, "a"_a, "b"_a);
}
