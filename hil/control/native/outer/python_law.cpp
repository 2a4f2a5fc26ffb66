#include "python_law.hpp"

namespace nb = nanobind;

namespace {

nb::object pair(const outer::Vec2& v) { return nb::make_tuple(std::get<0>(v), std::get<1>(v)); }

// Values as their constructors would make them; the classes are frozen, and their constructors slow for that.
class Maker {
 public:
  nb::object of(const outer::ReferenceState& r) const {
    return filled(reference_, {"z1_m", "z1_dot_m_s", "z1_ddot_m_s2", "z1_dddot_m_s3"},
                  {pair(r.z1_m), pair(r.z1_dot_m_s), pair(r.z1_ddot_m_s2), pair(r.z1_dddot_m_s3)});
  }
  nb::object of(const outer::Estimate& e) const {
    const nb::object pose =
        filled(pose_, {"x_m", "y_m", "theta_rad"},
               {nb::float_(e.pose.x_m), nb::float_(e.pose.y_m), nb::float_(e.pose.theta_rad)});
    const nb::object z3 = e.z3_m_s2.is_none() ? nb::none() : pair(e.z3_m_s2);
    return filled(
        estimate_,
        {"t_host_s", "pose", "eta1_m_s", "theta_dot_rad_s", "z1_m", "z2_m_s", "z3_m_s2", "sides_at_limit",
         "driven_hard"},
        {nb::float_(e.t_host_s), pose, nb::float_(e.eta1_m_s), nb::float_(e.theta_dot_rad_s), pair(e.z1_m),
         pair(e.z2_m_s), z3, nb::make_tuple(std::get<0>(e.sides_at_limit), std::get<1>(e.sides_at_limit)),
         nb::bool_(e.driven_hard)});
  }

 private:
  template <std::size_t N>
  static nb::object filled(const nb::object& type, const char* const (&names)[N],
                           const nb::object (&values)[N]) {
    static PyObject* interned[N] = {};
    static PyObject* nothing = PyTuple_New(0);
    PyTypeObject* kind = reinterpret_cast<PyTypeObject*>(type.ptr());
    const nb::object out = nb::steal(kind->tp_new(kind, nothing, nullptr));
    for (std::size_t i = 0; i < N; ++i) {
      if (interned[i] == nullptr) interned[i] = PyUnicode_InternFromString(names[i]);
      if (PyObject_GenericSetAttr(out.ptr(), interned[i], values[i].ptr()) != 0) throw nb::python_error();
    }
    return out;
  }

  nb::object types_ = nb::module_::import_("hil.core.types");
  nb::object reference_ = types_.attr("ReferenceState"), estimate_ = types_.attr("Estimate"),
             pose_ = types_.attr("Pose");
};

const Maker& made() {
  static const Maker* maker = new Maker();  // never freed: the interpreter ends first
  return *maker;
}

}  // namespace

PythonLaw::PythonLaw(const nb::object& law, const nb::tuple& own)
    : reset_(law.attr("reset")), step_(law.attr("step")) {
  for (const char* key : outer::kTraceKeys) keys_.push_back(nb::str(key));
  for (nb::handle key : own) keys_.push_back(nb::borrow(key));
  if (keys_.size() > outer::kTraceSlots) throw nb::value_error("too many names in the trace");
}

void PythonLaw::reset(const outer::ReferenceState& reference, const outer::Estimate& estimate) {
  reset_(made().of(reference), made().of(estimate));
}

outer::OuterCommand PythonLaw::step(const outer::ReferenceState& reference, const outer::Estimate& estimate,
                                    double dt_s) {
  const nb::object out = step_(made().of(reference), made().of(estimate), dt_s);
  return {nb::cast<double>(out.attr("eta1_m_s")), nb::cast<double>(out.attr("theta_dot_rad_s")),
          trace_of(out.attr("trace"))};
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
    const double found = PyFloat_AsDouble(value.ptr());
    if (found == -1.0 && PyErr_Occurred() != nullptr) throw nb::python_error();
    out = std::move(out).with(key, found);
  }
  return out;
}
