// What the steps of robots side by side cost, by width (hil bench).
#include <algorithm>
#include <ctime>
#include <memory>
#include <stdexcept>

#include "lane_seat.hpp"

namespace twin {
namespace {

constexpr double kStep_s = 1e-4;
constexpr int kTick_steps = 40;  // under one duty

Pair duty_at(int step) {
  const int tick = step / kTick_steps;
  return Pair{0.3 + 0.1 * (tick % 5), 0.4 - 0.2 * (tick % 3)};
}

double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void alone(Plant& plant, int steps) {
  for (int step = 0; step < steps; ++step) {
    Drive drive;
    drive.duty = duty_at(step);
    plant.step(kStep_s, drive);
  }
}

template <int kWidth>
double side_by_side(LaneRun run, const Plant& plant, int runs, int steps) {
  const auto block = std::make_unique<LaneBlock<kWidth>>();
  double spent_s = 0.0;
  for (int first = 0; first < runs; first += kWidth) {
    for (int lane = 0; lane < kWidth; ++lane) {
      seat_robot(*block, lane, plant, kStep_s);
      seat_state(*block, lane, plant.state());
    }
    const double begin_s = processor_s();
    for (int step = 0; step < steps; step += kTick_steps) {
      const Pair duty = duty_at(step);
      for (int lane = 0; lane < kWidth; ++lane) {
        for (int side = 0; side < 2; ++side) block->duty[side][lane] = duty[side];
      }
      run(block.get(), 0, std::min(kTick_steps, steps - step), false);
    }
    spent_s += processor_s() - begin_s;
  }
  return spent_s;
}

}  // namespace

double plant_lane_time(const PlantParams& params, Width width, int runs, int steps) {
  require_width(width);
  const Plant plant(params);
  if (runs < 1 || steps < 1 || runs % static_cast<int>(width) != 0 || !plant.rolls()) {
    throw std::invalid_argument("rolling robots, a whole number of registers full, and a step at least");
  }
  if (width == Width::kTwo) return side_by_side<2>(run_two, plant, runs, steps);
#ifdef TWIN_WIDE_LANES
  if (width == Width::kFour) return side_by_side<4>(run_four, plant, runs, steps);
  if (width == Width::kEight) return side_by_side<8>(run_eight, plant, runs, steps);
#endif
  double spent_s = 0.0;
  for (int i = 0; i < runs; ++i) {
    Plant one = plant;
    const double begin_s = processor_s();
    alone(one, steps);
    spent_s += processor_s() - begin_s;
  }
  return spent_s;
}

}  // namespace twin
