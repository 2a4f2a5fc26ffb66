// Python module hil.control.estimators._fused: the default estimator and its parts.
// Signatures and units for Python readers: hil/control/estimators/_fused.pyi.
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "fused.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using estimator::Assumptions;
using estimator::CommandHistory;
using estimator::Fused;
using estimator::Geometry;
using estimator::Piece;
using estimator::Pose;
using estimator::PoseFilter;
using estimator::WheelSpeeds;

void bind_assumptions(nb::module_& m) {
  nb::class_<Assumptions> assumptions(m, "Assumptions");
  assumptions.def(nb::init<>());
  nb::list names;
#define X(type, name)                            \
  assumptions.def_rw(#name, &Assumptions::name); \
  names.append(#name);
  ESTIMATOR_ASSUMPTIONS(X)
#undef X
  m.attr("ASSUMPTIONS") = nb::tuple(names);
}

// Pieces of command as Python has them: (duration, left, right).
nb::list to_python(const std::vector<Piece>& pieces) {
  nb::list out;
  for (const Piece& p : pieces) {
    out.append(nb::make_tuple(p.duration_s, p.omega_rad_s[0], p.omega_rad_s[1]));
  }
  return out;
}

std::vector<Piece> from_python(const nb::list& pieces) {
  std::vector<Piece> out;
  for (nb::handle piece : pieces) {
    const auto [duration_s, left, right] = nb::cast<std::array<double, 3>>(piece);
    out.push_back({duration_s, {left, right}});
  }
  return out;
}

void bind_odometry(nb::module_& m) {
  nb::class_<Geometry>(m, "Geometry")
      .def(
          "__init__",
          [](Geometry* self, double wheel_radius_m, double track_width_m, double d0_m, double rad_per_count,
             double omega_max_rad_s) {
            new (self) Geometry{wheel_radius_m, track_width_m, d0_m, rad_per_count, omega_max_rad_s};
          },
          "wheel_radius_m"_a, "track_width_m"_a, "d0_m"_a, "rad_per_count"_a, "omega_max_rad_s"_a = 40.0)
      .def(
          "body",
          [](const Geometry& g, double left, double right) {
            const estimator::BodyMotion motion = g.body({left, right});
            return std::pair(motion.forward_m, motion.turn_rad);
          },
          "left"_a, "right"_a);
  m.def("counts_between", &estimator::counts_between, "old"_a, "new"_a);
  nb::class_<CommandHistory>(m, "CommandHistory")
      .def(nb::init<>())
      .def(
          "add", [](CommandHistory& h, double t_s, double left, double right) { h.add(t_s, {left, right}); },
          "t_s"_a, "left_rad_s"_a, "right_rad_s"_a)
      .def("forget_before", &CommandHistory::forget_before, "t_s"_a)
      .def(
          "segments",
          [](const CommandHistory& h, double t0_s, double t1_s) {
            std::vector<Piece> pieces;
            h.segments(t0_s, t1_s, pieces);
            return to_python(pieces);
          },
          "t0_s"_a, "t1_s"_a);
  nb::class_<WheelSpeeds>(m, "WheelSpeeds")
      .def(nb::init<double, double, double, double>(), "lag_s"_a, "sigma_accel_rad_s2"_a,
           "sigma_short_rad_s15"_a, "unit_rad"_a)
      .def("restart", &WheelSpeeds::restart)
      .def(
          "ahead",
          [](const WheelSpeeds& speeds, const nb::list& pieces) {
            const WheelSpeeds::Ahead out = speeds.ahead(from_python(pieces));
            return nb::make_tuple(out.angle_rad[0], out.angle_rad[1], out.omega_rad_s[0], out.omega_rad_s[1]);
          },
          "pieces"_a)
      .def(
          "step",
          [](WheelSpeeds& speeds, double dt_s, std::pair<double, double> turned, const nb::list& pieces) {
            speeds.step(dt_s, {turned.first, turned.second}, from_python(pieces));
          },
          "dt_s"_a, "turned_rad"_a, "pieces"_a)
      .def_prop_ro("omega_rad_s", [](const WheelSpeeds& speeds) {
        return std::pair(speeds.omega_rad_s()[0], speeds.omega_rad_s()[1]);
      });
}

void bind_filter(nb::module_& m) {
  m.def("wrap_pi", &estimator::wrap_pi, "angle_rad"_a);
  nb::class_<PoseFilter>(m, "PoseFilter")
      .def(nb::init<const Assumptions&, double>(), "assumptions"_a, "d0_m"_a)
      .def(
          "place",
          [](PoseFilter& f, double x_m, double y_m, double theta_rad, double sigma_xy_m,
             double sigma_theta_rad) { f.place({x_m, y_m, theta_rad}, sigma_xy_m, sigma_theta_rad); },
          "x_m"_a, "y_m"_a, "theta_rad"_a, "sigma_xy_m"_a, "sigma_theta_rad"_a)
      .def("move", &PoseFilter::move, "dt_s"_a, "forward_m"_a, "turn_rad"_a, "length_m"_a, "angle_rad"_a)
      .def(
          "innovation",
          [](const PoseFilter& f, double x_m, double y_m, double theta_rad) {
            const estimator::Innovation i = f.innovation({x_m, y_m, theta_rad});
            return nb::make_tuple(i[0], i[1], i[2]);
          },
          "x_m"_a, "y_m"_a, "theta_rad"_a)
      .def("correct", &PoseFilter::correct, "innovation"_a, "var_xy"_a, "var_theta"_a, "gate"_a,
           "excess"_a = estimator::Excess{})
      .def_prop_ro("x", [](const PoseFilter& f) { return f.mean(); })
      .def_prop_ro("P", [](const PoseFilter& f) { return f.covariance(); });
}

nb::object state_at(const Fused& fused, double t_host_s) {
  const std::optional<estimator::State> state = fused.state_at(t_host_s);
  if (!state) return nb::none();
  const Pose& pose = state->pose;
  return nb::make_tuple(pose.x_m, pose.y_m, pose.theta_rad, state->eta1_m_s, state->theta_dot_rad_s,
                        nb::make_tuple(state->z1_m[0], state->z1_m[1]),
                        nb::make_tuple(state->z2_m_s[0], state->z2_m_s[1]));
}

void bind_fused(nb::module_& m) {
  nb::class_<Fused>(m, "Fused")
      .def(nb::init<const Assumptions&, const Geometry&>(), "assumptions"_a, "geometry"_a)
      .def(
          "take_command",
          [](Fused& f, double t_effect_s, double left, double right) {
            f.take_command(t_effect_s, {left, right});
          },
          "t_effect_s"_a, "left_rad_s"_a, "right_rad_s"_a)
      .def("take_wheels", &Fused::take_wheels, "t_host_s"_a, "counts_left"_a, "counts_right"_a)
      .def("expect", &Fused::expect, "excess"_a)
      .def(
          "take_pose",
          [](Fused& f, double t_exposure_s, double x_m, double y_m, double theta_rad, double sigma_xy_m,
             double sigma_theta_rad) {
            return f.take_pose(t_exposure_s, {x_m, y_m, theta_rad}, sigma_xy_m, sigma_theta_rad);
          },
          "t_exposure_s"_a, "x_m"_a, "y_m"_a, "theta_rad"_a, "sigma_xy_m"_a, "sigma_theta_rad"_a)
      .def("state_at", &state_at, "t_host_s"_a)
      .def("pose_age_s", &Fused::pose_age_s, "t_host_s"_a)
      .def("agreement_age_s", &Fused::agreement_age_s, "t_host_s"_a)
      .def_prop_ro("refused",
                   [](const Fused& f) {
                     const estimator::Innovation& i = f.refused();
                     return nb::make_tuple(i[0], i[1], i[2]);
                   })
      .def_prop_ro("covariance", [](const Fused& f) { return f.filter().covariance(); })
      .def_prop_ro("scales",
                   [](const Fused& f) {
                     const estimator::Vector& x = f.filter().mean();
                     return std::pair(x[estimator::kDistance], x[estimator::kTurn]);
                   })
      .def_prop_ro("d0_m", [](const Fused& f) { return f.filter().mean()[estimator::kOffset]; })
      .def_prop_ro("gated_total", &Fused::gated_total);
}

}  // namespace

NB_MODULE(_fused, m) {
  nb::set_leak_warnings(false);  // values held by a test session at exit are no leak
  bind_assumptions(m);
  bind_odometry(m);
  bind_filter(m);
  bind_fused(m);
}
