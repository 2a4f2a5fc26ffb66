// Values of hil.core.types for Python, made from native ones.
#ifndef HIL_CORE_ESTIMATE_MADE_HPP
#define HIL_CORE_ESTIMATE_MADE_HPP

#include <nanobind/nanobind.h>

#include <cstddef>

namespace hil {

// A frozen class of N fields: values as its constructor would make them, which is slow for being frozen. Lives
// as long as the interpreter.
template <std::size_t N>
class FrozenClass {
 public:
  FrozenClass(const char* name, const char* const (&fields)[N])
      : kind_(nanobind::module_::import_("hil.core.types").attr(name)), nothing_(PyTuple_New(0)) {
    for (std::size_t i = 0; i < N; ++i) fields_[i] = PyUnicode_InternFromString(fields[i]);
  }

  nanobind::object of(const nanobind::object (&values)[N]) const {
    PyTypeObject* kind = reinterpret_cast<PyTypeObject*>(kind_.ptr());
    nanobind::object out = nanobind::steal(kind->tp_new(kind, nothing_, nullptr));
    for (std::size_t i = 0; i < N; ++i) {
      if (PyObject_GenericSetAttr(out.ptr(), fields_[i], values[i].ptr()) != 0)
        throw nanobind::python_error();
    }
    return out;
  }

 private:
  nanobind::object kind_;
  PyObject* nothing_;
  PyObject* fields_[N];
};

// Makes an Estimate of the fields that the estimators and the laws name otherwise.
class EstimateClass {
 public:
  struct Motion {
    double t_host_s, x_m, y_m, theta_rad, eta1_m_s, theta_dot_rad_s;
  };

  nanobind::object of(const Motion& m, const nanobind::object& z1_m, const nanobind::object& z2_m_s,
                      const nanobind::object& z3_m_s2, const nanobind::object& sides_at_limit,
                      bool driven_hard) const {
    using nanobind::float_;
    const nanobind::object pose = pose_.of({float_(m.x_m), float_(m.y_m), float_(m.theta_rad)});
    return estimate_.of({float_(m.t_host_s), pose, float_(m.eta1_m_s), float_(m.theta_dot_rad_s), z1_m,
                         z2_m_s, z3_m_s2, sides_at_limit, nanobind::bool_(driven_hard)});
  }

 private:
  FrozenClass<3> pose_{"Pose", {"x_m", "y_m", "theta_rad"}};
  FrozenClass<9> estimate_{"Estimate",
                           {"t_host_s", "pose", "eta1_m_s", "theta_dot_rad_s", "z1_m", "z2_m_s", "z3_m_s2",
                            "sides_at_limit", "driven_hard"}};
};

}  // namespace hil

#endif
