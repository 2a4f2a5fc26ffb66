// Kernels side by side, for Python (sim_twin/_native.pyi).
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>
#include <vector>

#include "lanes.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using twin::Kernel;
using twin::Leg;
using twin::Width;

std::vector<int> lane_widths() {
  std::vector<int> out;
  for (const Width width : twin::widths()) out.push_back(static_cast<int>(width));
  return out;
}

// A leg's end: the time reached, or the text of what was thrown.
nb::object ended(const Leg& leg) {
  if (!leg.failed) return nb::int_(leg.reached_us);
  try {
    std::rethrow_exception(leg.failed);
  } catch (const std::runtime_error& error) {
    return nb::str(error.what());
  }
}

nb::list advance_together(const std::vector<Kernel*>& kernels, const std::vector<std::int64_t>& t_us,
                          int lanes) {
  if (kernels.size() != t_us.size()) throw std::invalid_argument("one time for each kernel");
  std::vector<Leg> legs;
  for (std::size_t i = 0; i < kernels.size(); ++i) legs.push_back({kernels[i], t_us[i]});
  if (lanes == 0) {
    twin::advance_together(legs.data(), legs.size());
  } else {
    twin::advance_together(legs.data(), legs.size(), static_cast<Width>(lanes));
  }
  nb::list out;
  for (const Leg& leg : legs) out.append(nb::make_tuple(ended(leg), leg.together));
  return out;
}

using Angles = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Numbers = nb::ndarray<nb::numpy, double, nb::ndim<1>>;

nb::tuple directions(const Angles& angle_rad, int lanes) {
  const std::size_t n = angle_rad.shape(0);
  auto* const both = new double[2 * n];
  const nb::capsule owner(both, [](void* p) noexcept { delete[] static_cast<double*>(p); });
  twin::directions(static_cast<Width>(lanes), angle_rad.data(), both, both + n, n);
  return nb::make_tuple(Numbers(both, {n}, owner), Numbers(both + n, {n}, owner));
}

}  // namespace

void bind_lanes(nb::module_& m) {
  m.def("lane_widths", &lane_widths);
  m.def(
      "plant_lane_time",
      [](const twin::PlantParams& params, int lanes, int runs, int steps) {
        return twin::plant_lane_time(params, static_cast<Width>(lanes), runs, steps);
      },
      "params"_a, "lanes"_a, "runs"_a, "steps"_a);
  m.def("directions", &directions, "angle_rad"_a, "lanes"_a);
  m.def("advance_together", &advance_together, "kernels"_a, "t_us"_a, "lanes"_a = 0);
}
