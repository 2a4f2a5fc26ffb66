#include "python_law.hpp"

#include "estimate_made.hpp"

namespace nb = nanobind;

namespace {

nb::object pair(const outer::Vec2& v) { return nb::make_tuple(std::get<0>(v), std::get<1>(v)); }

class Maker {
 public:
  nb::object of(const outer::ReferenceState& r) const {
    return reference_.of({pair(r.z1_m), pair(r.z1_dot_m_s), pair(r.z1_ddot_m_s2), pair(r.z1_dddot_m_s3)});
  }
  nb::object of(const outer::Estimate& e) const {
    const nb::object z3 = e.z3_m_s2.is_none() ? nb::none() : pair(e.z3_m_s2);
    return estimate_.of({e.t_host_s, e.pose.x_m, e.pose.y_m, e.pose.theta_rad, e.eta1_m_s, e.theta_dot_rad_s},
                        pair(e.z1_m), pair(e.z2_m_s), z3,
                        nb::make_tuple(std::get<0>(e.sides_at_limit), std::get<1>(e.sides_at_limit)),
                        e.driven_hard);
  }

 private:
  hil::FrozenClass<4> reference_{"ReferenceState", {"z1_m", "z1_dot_m_s", "z1_ddot_m_s2", "z1_dddot_m_s3"}};
  hil::EstimateClass estimate_;
};

double number(const nb::object& value) {
  const double found = PyFloat_AsDouble(value.ptr());
  if (found == -1.0 && PyErr_Occurred() != nullptr) throw nb::python_error();
  return found;
}

const Maker& made() {
  static const Maker* maker = new Maker();  // never freed: the interpreter ends first
  return *maker;
}

}  // namespace

PythonLaw::PythonLaw(const nb::object& law, const nb::tuple& own) : law_(law) {
  for (const char* key : outer::kTraceKeys) keys_.push_back(nb::str(key));
  for (nb::handle key : own) keys_.push_back(nb::borrow(key));
  if (keys_.size() > outer::kTraceSlots) throw nb::value_error("too many names in the trace");
}

void PythonLaw::reset(const outer::ReferenceState& reference, const outer::Estimate& estimate) {
  law_.attr("reset")(made().of(reference), made().of(estimate));
}

outer::OuterCommand PythonLaw::step(const outer::ReferenceState& reference, const outer::Estimate& estimate,
                                    double dt_s) {
  const nb::object out = law_.attr("step")(made().of(reference), made().of(estimate), dt_s);
  return {number(out.attr("eta1_m_s")), number(out.attr("theta_dot_rad_s")), trace_of(out.attr("trace"))};
}

outer::Trace PythonLaw::trace_of(const nb::object& trace) const {
  outer::Trace out;
  const bool plain = PyDict_CheckExact(trace.ptr());
  for (std::size_t key = 0; key < keys_.size(); ++key) {
    nb::object value;
    if (plain) {
      value = nb::borrow(PyDict_GetItem(trace.ptr(), keys_[key].ptr()));
    } else if (nb::cast<bool>(trace.attr("__contains__")(keys_[key]))) {
      value = trace.attr("__getitem__")(keys_[key]);
    }
    if (!value.is_valid()) continue;
    out = std::move(out).with(key, number(value));
  }
  return out;
}
