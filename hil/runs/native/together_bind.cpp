// Runs side by side as hil.runs._native has them.
#include <nanobind/nanobind.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstring>
#include <string>
#include <tuple>
#include <vector>

#include "answered_law.hpp"
#include "together.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using outer::AnsweredLaw;
using runs::Together;
using Laws = std::vector<AnsweredLaw*>;

// In the order of hil.core.batch.asked, and whether it is to start anew.
template <typename Put>
void question(const AnsweredLaw::Question& q, Put put) {
  const outer::Estimate& e = q.estimate;
  const outer::ReferenceState& r = q.reference;
  for (const double value :
       {e.t_host_s, e.pose.x_m, e.pose.y_m, e.pose.theta_rad, e.eta1_m_s, e.theta_dot_rad_s}) {
    put(value);
  }
  const auto both = [&put](const outer::Vec2& v) { put(std::get<0>(v)), put(std::get<1>(v)); };
  both(e.z1_m);
  both(e.z2_m_s);
  put(std::get<0>(e.sides_at_limit));
  put(std::get<1>(e.sides_at_limit));
  put(e.driven_hard ? 1.0 : 0.0);
  for (const outer::Vec2* v : {&r.z1_m, &r.z1_dot_m_s, &r.z1_ddot_m_s2, &r.z1_dddot_m_s3}) both(*v);
  put(q.dt_s);
  put(q.reset ? 1.0 : 0.0);
}

constexpr std::size_t kQuestion = 23;

nb::bytes questions(const Laws& laws) {
  std::vector<double> out(kQuestion * laws.size());
  for (std::size_t i = 0; i < laws.size(); ++i) {
    std::size_t row = 0;
    question(laws[i]->question(), [&](double value) { out[row++ * laws.size() + i] = value; });
  }
  return nb::bytes(reinterpret_cast<const char*>(out.data()), out.size() * sizeof(double));
}

// Rows of `answers`: forward speeds, turn rates, then the traces' values at `places`.
void answer(const Laws& laws, const nb::bytes& answers, const std::vector<std::size_t>& places) {
  std::vector<double> given((2 + places.size()) * laws.size());
  for (const std::size_t place : places) {
    if (place >= outer::kTraceSlots) throw nb::value_error("no place of a trace");
  }
  if (answers.size() != given.size() * sizeof(double)) throw nb::value_error("not an answer for each law");
  std::memcpy(given.data(), answers.c_str(), answers.size());
  for (std::size_t i = 0; i < laws.size(); ++i) {
    const auto row = [&](std::size_t at) { return given[at * laws.size() + i]; };
    outer::Trace trace;
    for (std::size_t term = 0; term < places.size(); ++term) {
      trace = std::move(trace).with(places[term], row(2 + term));
    }
    laws[i]->answer({row(0), row(1), trace});
  }
}

}  // namespace

void bind_together(nb::module_& m) {
  nb::class_<AnsweredLaw, outer::OuterLaw>(m, "AnsweredLaw").def(nb::init<>());
  m.def("questions", &questions, "laws"_a);
  m.def("answer", &answer, "laws"_a, "answers"_a, "places"_a);
  nb::class_<Together>(m, "Together")
      .def(nb::init<>())
      .def("add", &Together::add, nb::keep_alive<1, 2>(), "drive"_a)
      .def(
          "go_on",
          [](Together& together, std::size_t place, bool busy, bool refused, const nb::tuple& board) {
            together.go_on(
                place, busy, refused,
                {nb::cast<std::int64_t>(board[0]), nb::cast<double>(board[1]), nb::cast<double>(board[2])});
          },
          "place"_a, "busy"_a, "refused"_a, "board"_a)
      .def("answered", &Together::answered, "place"_a)
      .def("run", &Together::run)
      .def_prop_ro("waiting", &Together::waiting)
      .def("end", &Together::end, "place"_a)
      .def("rethrow", [](Together& together, std::size_t place) { together.rethrow(place); }, "place"_a);
  m.attr("FAILED") = static_cast<int>(Together::kFailed);
}
