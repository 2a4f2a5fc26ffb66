// Several kernels moved on at once: their robots' steps side by side, one in each lane of the processor's
// registers, and everything else (boards, encoders, remembered poses) kernel by kernel between them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <vector>

#include "kernel.hpp"

namespace twin {

// Robots side by side. Every width gives the same bits; kOne is Kernel::advance.
enum class Width : int { kOne = 1, kTwo = 2, kFour = 4, kEight = 8 };
// What this processor has, narrowest first.
std::vector<Width> widths();

struct Leg {
  Kernel* kernel = nullptr;
  std::int64_t t_us = 0;        // to be reached
  std::int64_t reached_us = 0;  // as Kernel::advance returns it
  std::exception_ptr failed;    // what it threw; the other legs are moved all the same
  std::int64_t together = 0;    // steps that were taken in a lane
};

// As Kernel::advance(t_us) of one leg after the other: the same bits in all that a kernel holds and in all
// that its board sends. No kernel, and no board, may be in two legs.
void advance_together(Leg* legs, std::size_t n);
void advance_together(Leg* legs, std::size_t n, Width width);

// Cosine and sine of each angle, as a step has them; n: a whole number of registers full.
void directions(Width width, const double* angle_rad, double* cos, double* sin, std::size_t n);

// Processor time in s that `runs` robots of this kind (a whole number of registers full) take for `steps` steps of
// 1e-4 s each, driving under duties that change every 4 ms, without boards: the plant's share of the above.
double plant_lane_time(const PlantParams& params, Width width, int runs, int steps);

}  // namespace twin
