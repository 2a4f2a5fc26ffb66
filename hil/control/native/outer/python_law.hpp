// A law in Python as native code asks it: one that is not translated, of the project or of somebody's own.
#pragma once

#include <nanobind/nanobind.h>

#include <vector>

#include "outer_laws.hpp"

class PythonLaw final : public outer::OuterLaw {
 public:
  // `own` are the names of its trace that the record keeps, besides kTraceKeys; from kTraceSize on.
  PythonLaw(const nanobind::object& law, const nanobind::tuple& own);

  void reset(const outer::ReferenceState& reference, const outer::Estimate& estimate) override;
  outer::OuterCommand step(const outer::ReferenceState& reference, const outer::Estimate& estimate,
                           double dt_s) override;

 private:
  outer::Trace trace_of(const nanobind::object& trace) const;

  nanobind::object reset_, step_;
  std::vector<nanobind::object> keys_;
};
