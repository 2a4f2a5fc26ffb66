// Python side of chance, link, camera timing, drawn poses and the rig about them.
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "drawn_rig.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using twin::Chance;
using twin::Span;

using Words = std::vector<std::uint32_t>;

// The state of a random.Random: getstate()[1].
Chance chance_of(const Words& words) {
  Chance::State state;
  if (words.size() != state.size()) throw std::invalid_argument("not a state of random.Random");
  std::copy(words.begin(), words.end(), state.begin());
  return Chance(state);
}

std::string text(const nb::bytes& data) { return {data.c_str(), data.size()}; }

nb::bytes bytes_of(const std::string& data) { return nb::bytes(data.data(), data.size()); }

nb::tuple pose_tuple(const twin::PoseSample& p) { return nb::make_tuple(p.x_m, p.y_m, p.theta_rad); }

nb::object carried(twin::Channel& channel, double t_s, const nb::bytes& data) {
  const auto arrival = channel.carry(t_s, text(data));
  if (!arrival) return nb::none();
  return nb::make_tuple(arrival->first, bytes_of(arrival->second));
}

nb::object exposed(twin::Shutter& shutter, const std::vector<Span>& stalls) {
  const auto e = shutter.next(stalls);
  if (!e) return nb::none();
  return nb::make_tuple(e->index, e->start_s, e->end_s, e->t_cam_s, e->arrival_s);
}

nb::object measured(twin::DrawnPoses& drawn, double x_m, double y_m, double theta_rad) {
  const auto seen = drawn.measure({x_m, y_m, theta_rad});
  return seen ? nb::object(pose_tuple(*seen)) : nb::none();
}

nb::tuple tuple_of(const std::vector<twin::PoseSample>& poses) {
  nb::list out;
  for (const twin::PoseSample& pose : poses) out.append(pose_tuple(pose));
  return nb::tuple(out);
}

nb::object taken(twin::Rig& rig) {
  const auto frame = rig.take_frame();
  if (!frame) return nb::none();
  return nb::make_tuple(frame->exposure.index, frame->exposure.start_s, frame->exposure.t_cam_s,
                        tuple_of(frame->poses));
}

// Number, begin and poses of the exposure that the picture of the last frame shows; None without one.
nb::object shown(const twin::DrawnRig& rig) {
  if (!rig.shown()) return nb::none();
  const auto& [exposure, poses] = *rig.shown();
  return nb::make_tuple(exposure.index, exposure.start_s, tuple_of(poses));
}

// Number, stamp, pose (None where the robot was not seen), and why not.
nb::object drawn_frame(twin::DrawnRig& rig) {
  core::PoseFrame f;
  if (!rig.take_frame(f)) return nb::none();
  const nb::object pose = f.seen ? nb::object(nb::make_tuple(f.x_m, f.y_m, f.theta_rad)) : nb::none();
  return nb::make_tuple(f.index, f.t_cam_s, pose, f.reason);
}

// X, Y, theta, eta1, theta_dot now.
nb::tuple truth(const twin::Rig& rig) {
  const twin::PoseSample p = rig.pose_at(rig.now_s());
  const twin::StateVector& x = rig.kernel().state();
  return nb::make_tuple(p.x_m, p.y_m, p.theta_rad, x[twin::kEta1], x[twin::kThetaDot]);
}

void bind_parts(nb::module_& m) {
  nb::class_<twin::Serialiser>(m, "Serialiser")
      .def(nb::init<double>(), "byte_s"_a)
      .def("send", &twin::Serialiser::send, "t_s"_a, "size"_a);
  nb::class_<twin::Channel>(m, "Channel")
      .def(
          "__init__",
          [](twin::Channel* self, double latency_s, double jitter_s, double to_good, double to_bad,
             double corruption_ratio, const Words& chance) {
            new (self)
                twin::Channel({latency_s, jitter_s, to_good, to_bad, corruption_ratio}, chance_of(chance));
          },
          "latency_s"_a, "jitter_s"_a, "to_good"_a, "to_bad"_a, "corruption_ratio"_a, "chance"_a)
      .def("carry", &carried, "t_s"_a, "data"_a)
      .def_rw("cuts", &twin::Channel::cuts)
      .def_rw("doubles", &twin::Channel::doubles)
      .def_rw("swaps", &twin::Channel::swaps);
  nb::class_<twin::Shutter>(m, "Shutter")
      .def(
          "__init__",
          [](twin::Shutter* self, double period_s, double exposure_s, double latency_s, double jitter_s,
             double drop_ratio, double t_first_s, double clock_start_s, double clock_rate, double most_sigmas,
             const Words& chance) {
            new (self) twin::Shutter({period_s, exposure_s, latency_s, jitter_s, drop_ratio, t_first_s,
                                      clock_start_s, clock_rate, most_sigmas},
                                     chance_of(chance));
          },
          "period_s"_a, "exposure_s"_a, "latency_s"_a, "jitter_s"_a, "drop_ratio"_a, "t_first_s"_a,
          "clock_start_s"_a, "clock_rate"_a, "most_sigmas"_a, "chance"_a)
      .def("next", &exposed, "stalls"_a);
  // The order of `error`, as hil/data/localiser_error.toml names them.
  m.attr("LOCALISER_ERROR") = nb::make_tuple("not_seen_ratio", "outlier_ratio", "place_ratio", "sigma_xy_m",
                                             "sigma_theta_rad", "outlier_xy_m", "outlier_theta_rad");
  nb::class_<twin::DrawnPoses>(m, "DrawnPoses")
      .def(
          "__init__",
          [](twin::DrawnPoses* self, const std::array<double, 7>& error, bool swapped, double shift_m,
             const Words& chance) {
            new (self) twin::DrawnPoses(
                {error[0], error[1], error[2], error[3], error[4], error[5], error[6], swapped, shift_m},
                chance_of(chance));
          },
          "error"_a, "swapped"_a, "shift_m"_a, "chance"_a)
      .def("measure", &measured, "x_m"_a, "y_m"_a, "theta_rad"_a);
}

}  // namespace

void bind_rig(nb::module_& m) {
  bind_parts(m);
  using twin::Rig;
  nb::class_<Rig>(m, "Rig")
      .def(
          "__init__",
          [](Rig* self, twin::Kernel& kernel, double start_s, int baud, const twin::Channel& down,
             const twin::Channel& up, const twin::Shutter& shutter,
             double readout_s) { new (self) Rig(kernel, {start_s, baud, readout_s}, down, up, shutter); },
          nb::keep_alive<1, 2>(), "kernel"_a, "start_s"_a, "baud"_a, "down"_a, "up"_a, "shutter"_a,
          "readout_s"_a = 0.0)
      .def("set_spans", &Rig::set_spans, "stalls"_a, "hidden"_a)
      .def_prop_ro("down", &Rig::down, nb::rv_policy::reference_internal)
      .def_prop_ro("up", &Rig::up, nb::rv_policy::reference_internal)
      .def(
          "pose_at", [](const Rig& rig, double t_s) { return pose_tuple(rig.pose_at(t_s)); }, "t_s"_a)
      .def("now_s", &Rig::now_s)
      .def("wait", &Rig::wait, "until_s"_a, "poses"_a)
      .def("advance", &Rig::advance, "until_s"_a)
      .def("arrive", &Rig::arrive, "until_s"_a, "poses"_a)
      .def("read", [](Rig& rig) { return bytes_of(rig.read()); })
      .def(
          "send", [](Rig& rig, const nb::bytes& data) { rig.send(text(data)); }, "data"_a)
      .def("discard_unsent", &Rig::discard_unsent)
      .def("take_frame", &taken)
      .def("truth", &truth);
  using twin::DrawnRig;
  nb::module_::import_("hil.core._native");  // the type of the backlog
  nb::class_<DrawnRig>(m, "DrawnRig")
      .def(
          "__init__",
          [](DrawnRig* self, Rig& rig, twin::DrawnPoses& drawn, core::LineBacklog& backlog, double quality,
             double sigma_xy_m, double sigma_theta_rad, double true_d0_m, int poses) {
            new (self)
                DrawnRig(rig, drawn, {quality, sigma_xy_m, sigma_theta_rad, true_d0_m}, backlog, poses);
          },
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(), "rig"_a, "drawn"_a,
          "backlog"_a, "quality"_a, "sigma_xy_m"_a, "sigma_theta_rad"_a, "true_d0_m"_a, "poses"_a)
      .def("set_faults", &DrawnRig::set_faults, "repeats"_a, "stamp_steps"_a)
      .def("take_frame", &drawn_frame)
      .def("shown", &shown)
      .def("handle", [](DrawnRig& rig) {
        return nb::capsule(static_cast<core::SimulatedRig*>(&rig), core::kSimulatedRig);
      });
}
