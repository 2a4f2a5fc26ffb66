// Several rolling robots side by side, one in each lane of a register: what the units for the processors'
// widths (lane_two.cpp, lane_four.cpp, lane_eight.cpp) and their caller (lanes.cpp) share. Data alone: a function
// here could be compiled for wide registers and then be taken by code that runs everywhere.
#pragma once

#include "plant_model.hpp"

namespace twin {

template <int kWidth>
struct LaneVector;
template <>
struct LaneVector<2> {
  typedef double Numbers __attribute__((vector_size(16)));
};
template <>
struct LaneVector<4> {
  typedef double Numbers __attribute__((vector_size(32)));
};
template <>
struct LaneVector<8> {
  typedef double Numbers __attribute__((vector_size(64)));
};

template <int kWidth>
struct LaneBlock {
  using V = typename LaneVector<kWidth>::Numbers;
  static constexpr int kRows = 64;
  // Of each step's end: what is made of it afterwards, robot by robot.
  struct Row {
    V x_m, y_m, theta_rad, wheel_left_rad, wheel_right_rad;
  };

  Terms<V> terms;
  V castor;  // 1 or 0
  V h_s, half_h_s, sixth_h_s;
  V duty[2], jam[2];
  V x[kStates];
  V loads[3][kLoads];  // at a step's begin, middle and end
  V diverged;          // set where a wheel has run away, or a state is no number
  Row rows[kRows];
};

// Takes `steps` steps, all with the block's loads and jams or without; the row of the first one is rows[first].
using LaneRun = void (*)(void* block, int first, int steps, bool loaded);
void run_two(void* block, int first, int steps, bool loaded);
void run_four(void* block, int first, int steps, bool loaded);   // x86 with AVX2
void run_eight(void* block, int first, int steps, bool loaded);  // x86 with AVX-512
// Of as many angles as there are lanes.
using LaneDirect = void (*)(const double* angle_rad, double* cos, double* sin);
void direct_two(const double* angle_rad, double* cos, double* sin);
void direct_four(const double* angle_rad, double* cos, double* sin);
void direct_eight(const double* angle_rad, double* cos, double* sin);

}  // namespace twin
