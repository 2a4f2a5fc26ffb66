// Python module hil.control._laws; signatures and units for Python readers: hil/control/_laws.pyi.
#include <nanobind/nanobind.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "asg_ism.hpp"
#include "baselines.hpp"
#include "signals.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace control;

namespace {

using List = std::vector<double>;

Vec vec(const List& list, int n) {
  if (static_cast<int>(list.size()) != n) {
    throw std::invalid_argument("a vector of " + std::to_string(n) + " entries is needed, not " +
                                std::to_string(list.size()));
  }
  Vec out{};
  for (int i = 0; i < n; ++i) out[i] = list[i];
  return out;
}

int dimension(const List& list) {
  if (list.empty() || list.size() > kMaxDim) {
    throw std::invalid_argument("a law has 1 to 6 dimensions, not " + std::to_string(list.size()));
  }
  return static_cast<int>(list.size());
}

Vec spread(const List& list, int n) {
  return list.size() == 1 ? vec(List(n, list[0]), n) : list.empty() ? Vec{} : vec(list, n);
}

nb::tuple tuple(const Vec& values, int n) {
  nb::list out;
  for (int i = 0; i < n; ++i) out.append(values[i]);
  return nb::tuple(out);
}

void bind_law(nb::module_& m) {
  nb::class_<Law>(m, "Law")
      .def_prop_ro("dim", &Law::dim)
      .def_prop_ro("s_norm", &Law::s_norm)
      .def(
          "reset",
          [](Law& law, const List& p, const List& q) { law.reset(vec(p, law.dim()), vec(q, law.dim())); },
          "p"_a, "q"_a)
      .def(
          "output",
          [](Law& law, double t, const List& p, const List& q, double h) {
            return tuple(law.output(t, vec(p, law.dim()), vec(q, law.dim()), h), law.dim());
          },
          "t_s"_a, "p"_a, "q"_a, "dt_s"_a)
      .def(
          "rate",
          [](Law& law, const List& q_dot) { return tuple(law.rate(vec(q_dot, law.dim())), law.dim()); },
          "q_dot"_a)
      .def("advance", &Law::advance, "dt_s"_a);
}

void bind_asg(nb::module_& m) {
  nb::class_<AsgIsm, Law>(m, "AsgIsm")
      .def(
          "__init__",
          [](AsgIsm* self, const List& k, const List& eps_min, double mu0_s, double sigma, const List& kd,
             double eps0, double beta, double mu_min, bool componentwise, bool implicit, bool dominating,
             bool radial) {
            AsgGains gains;
            gains.n = dimension(k);
            gains.k = vec(k, gains.n);
            gains.eps_min = spread(eps_min, gains.n);
            gains.kd = spread(kd, gains.n);
            gains.mu0 = mu0_s;
            gains.sigma = sigma;
            gains.eps0 = eps0;
            gains.beta = beta;
            gains.mu_min = mu_min;
            gains.componentwise = componentwise;
            gains.implicit = implicit;
            gains.dominating = dominating;
            gains.radial = radial;
            new (self) AsgIsm(gains);
          },
          nb::kw_only(), "k"_a, "eps_min"_a, "mu0_s"_a, "sigma"_a, "kd"_a = List{}, "eps0"_a = 0.0,
          "beta"_a = 0.5, "mu_min"_a = 0.0, "componentwise"_a = false, "implicit"_a = false,
          "dominating"_a = false, "radial"_a = false)
      .def(
          "cost", [](const AsgIsm& law, const List& p) { return law.cost(vec(p, law.dim())); }, "p"_a)
      .def(
          "terms",
          [](AsgIsm& law, double t, const List& p, const List& q) {
            const int n = law.dim();
            const AsgTerms& now = law.observe(t, vec(p, n), vec(q, n));
            return nb::make_tuple(tuple(now.s, n), tuple(now.kappa, n), tuple(now.psi, n), tuple(now.dh, n),
                                  tuple(now.eps, n));
          },
          "t_s"_a, "p"_a, "q"_a)
      .def_rw("without_kappa", &AsgIsm::without_kappa)
      .def_rw("without_gamma", &AsgIsm::without_gamma)
      .def_prop_ro("eta", [](const AsgIsm& law) { return tuple(law.eta(), law.dim()); })
      .def_prop_ro("averaged", [](const AsgIsm& law) { return tuple(law.averaged(), law.dim()); });
}

void bind_baselines(nb::module_& m) {
  nb::class_<StateFeedback, Law>(m, "StateFeedback")
      .def(
          "__init__",
          [](StateFeedback* self, const List& kp, const List& kd, const List& ki) {
            const int n = dimension(kp);
            new (self) StateFeedback(n, vec(kp, n), spread(kd, n), spread(ki, n));
          },
          nb::kw_only(), "kp"_a, "kd"_a, "ki"_a = List{});
  nb::class_<SlidingMode, Law>(m, "SlidingMode")
      .def(
          "__init__",
          [](SlidingMode* self, const List& c, const List& k, const List& eps, bool each) {
            const int n = dimension(c);
            new (self) SlidingMode(n, vec(c, n), spread(k, n), spread(eps, n), each);
          },
          nb::kw_only(), "c"_a, "k"_a, "eps"_a, "componentwise"_a = false);
  nb::class_<UtkinIsm, Law>(m, "UtkinIsm")
      .def(
          "__init__",
          [](UtkinIsm* self, const List& kp, const List& kd, const List& k, const List& eps, bool each) {
            const int n = dimension(kp);
            new (self) UtkinIsm(n, vec(kp, n), spread(kd, n), spread(k, n), spread(eps, n), each);
          },
          nb::kw_only(), "kp"_a, "kd"_a, "k"_a, "eps"_a, "componentwise"_a = false);
}

void bind_signals(nb::module_& m) {
  nb::class_<SuperTwisting>(m, "SuperTwisting")
      .def(nb::init<double, double, double, bool>(), nb::kw_only(), "bound"_a, "l1"_a = 1.5, "l0"_a = 1.1,
           "implicit"_a = false)
      .def("reset", &SuperTwisting::reset, "x"_a, "rate"_a = 0.0)
      .def("set_bound", &SuperTwisting::set_bound, "bound"_a)
      .def_prop_ro("error", &SuperTwisting::error)
      .def("step", &SuperTwisting::step, "x"_a, "dt_s"_a);
  nb::class_<VariableGain>(m, "VariableGain")
      .def(nb::init<double, double, double, double, double>(), nb::kw_only(), "low"_a, "high"_a, "rate"_a,
           "threshold"_a, "average_s"_a)
      .def("step", &VariableGain::step, "error"_a, "dt_s"_a);
  nb::class_<LowPass>(m, "LowPass")
      .def(nb::init<double>(), "tau_s"_a)
      .def("reset", &LowPass::reset, "x"_a)
      .def_prop_ro("value", &LowPass::value)
      .def("step", &LowPass::step, "x"_a, "dt_s"_a);
  nb::class_<SmoothCommand>(m, "SmoothCommand")
      .def(nb::init<double>(), "rate_rad_s"_a)
      .def("reset", &SmoothCommand::reset, "x"_a)
      .def_prop_ro("value", &SmoothCommand::value)
      .def_prop_ro("rate", &SmoothCommand::rate)
      .def("acceleration", &SmoothCommand::acceleration, "x"_a)
      .def("step", &SmoothCommand::step, "x"_a, "dt_s"_a);
}

}  // namespace

NB_MODULE(_laws, m) {
  nb::set_leak_warnings(false);  // values held by a test session at exit are no leak
  bind_law(m);
  bind_asg(m);
  bind_baselines(m);
  bind_signals(m);
}
