// Puts a robot into a lane. For units that are compiled for every processor alone.
#pragma once

#include "lane_block.hpp"
#include "lanes.hpp"

namespace twin {

template <class Block>
void seat_robot(Block& block, int lane, const Plant& plant, double h_s) {
#define X(name) block.terms.name[lane] = plant.terms().name;
  TWIN_TERMS(X)
#undef X
  block.castor[lane] = plant.castor() ? 1.0 : 0.0;
  block.h_s[lane] = h_s;
  block.half_h_s[lane] = 0.5 * h_s;
  block.sixth_h_s[lane] = h_s / 6.0;
}

template <class Block>
void seat_state(Block& block, int lane, const StateVector& state) {
  for (int i = 0; i < kStates; ++i) block.x[i][lane] = state[i];
}

// Throws std::invalid_argument where the processor has no such registers.
void require_width(Width width);

}  // namespace twin
