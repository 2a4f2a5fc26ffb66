#include "lanes.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <numeric>
#include <stdexcept>

#include "lane_seat.hpp"

namespace twin {
namespace {

template <class Act>
void guarded(Leg& leg, Act act) {
  try {
    act();
  } catch (...) {
    leg.failed = std::current_exception();
  }
  leg.reached_us = leg.kernel->time_us();
}

void alone(Leg& leg) {
  guarded(leg, [&] { leg.kernel->advance(leg.t_us); });
}

// Takes what is no even step, until there are even ones to take or the leg is at its end: returns how many.
std::int64_t next_steps(Leg& leg) {
  std::int64_t steps = 0;
  guarded(leg, [&] {
    Kernel& kernel = *leg.kernel;
    while (kernel.goes_on(leg.t_us)) {
      kernel.coast(leg.t_us);
      if (!kernel.goes_on(leg.t_us)) return;
      steps = kernel.even_steps(leg.t_us);
      if (steps > 0) return;
      kernel.step();
    }
  });
  return leg.failed ? 0 : steps;
}

template <int kWidth>
class Lanes {
 public:
  Lanes(LaneRun run, Leg* legs, std::vector<std::size_t> order)
      : run_(run), legs_(legs), order_(std::move(order)) {
    for (auto& at : block_.loads) std::fill(std::begin(at), std::end(at), V{});
  }

  // Moves the legs until so few are under way that half the width holds them, and returns those.
  std::vector<std::size_t> run() {
    for (int lane = 0; lane < kWidth; ++lane) fill(lane);
    while (count() > kWidth / 2) {
      const int steps = run_steps();
      take(steps);
      for (int lane = 0; lane < kWidth; ++lane) {
        if (seats_[lane].leg != nullptr) settle(lane, steps);
      }
      if (row_ == Block::kRows) row_ = 0;
    }
    std::vector<std::size_t> left;
    for (int lane = 0; lane < kWidth; ++lane) {
      const Seat& seat = seats_[lane];
      if (seat.leg == nullptr) continue;
      if (row_ > seat.first) hand_over(lane);
      if (!seat.leg->failed) left.push_back(static_cast<std::size_t>(seat.leg - legs_));
    }
    return left;
  }

 private:
  using Block = LaneBlock<kWidth>;
  using V = typename Block::V;
  struct Seat {
    Leg* leg = nullptr;
    std::int64_t left = 0;  // steps to be taken before the kernel has to be asked
    int first = 0;          // row of the first that it does not know yet
    bool loaded = false;    // the lane has loads or a jam
    double sag_v = 0.0;     // of the battery at the end of the last step
  };

  int count() const {
    return static_cast<int>(
        std::count_if(seats_.begin(), seats_.end(), [](const Seat& seat) { return seat.leg != nullptr; }));
  }

  int run_steps() const {
    std::int64_t steps = Block::kRows - row_;
    for (const Seat& seat : seats_) {
      if (seat.leg != nullptr) steps = std::min(steps, seat.left);
    }
    return static_cast<int>(steps);
  }

  void take(int steps) {
    block_.diverged = V{};
    const bool loaded = std::any_of(seats_.begin(), seats_.end(),
                                    [](const Seat& seat) { return seat.leg != nullptr && seat.loaded; });
    if (!loaded) {
      run_(&block_, row_, steps, false);
      row_ += steps;
      return;
    }
    for (const int end = row_ + steps; row_ < end; ++row_) {
      for (int lane = 0; lane < kWidth; ++lane) {
        if (seats_[lane].leg != nullptr && seats_[lane].loaded) load_loads(lane);
      }
      run_(&block_, row_, 1, true);
    }
  }

  // Seats the next leg that has even steps to take; an empty lane goes on with whatever it holds.
  void fill(int lane) {
    Seat& seat = seats_[lane];
    seat.leg = nullptr;
    while (next_ < order_.size()) {
      Leg& leg = legs_[order_[next_++]];
      const std::int64_t steps = next_steps(leg);
      if (steps == 0) continue;
      seat.leg = &leg;
      seat.left = steps;
      seat.first = row_ % Block::kRows;
      load_robot(lane, *leg.kernel);
      load_state(lane, *leg.kernel);
      if (!filled_) spread(lane);
      return;
    }
  }

  // Work done since `first` goes to the kernel where it is due or the rows are full.
  void settle(int lane, int steps) {
    Seat& seat = seats_[lane];
    seat.left -= steps;
    if (block_.diverged[lane] != 0.0) {  // the kernel has not yet heard of these steps: it takes them itself
      alone(*seat.leg);
      fill(lane);
      return;
    }
    if (seat.left > 0 && row_ < Block::kRows) return;
    Leg& leg = *seat.leg;
    hand_over(lane);
    seat.first = row_ % Block::kRows;
    if (leg.failed) {
      fill(lane);
    } else if (seat.left == 0) {
      const std::int64_t reached_us = leg.reached_us;
      seat.left = next_steps(leg);
      if (seat.left == 0) {
        fill(lane);
      } else if (leg.reached_us != reached_us) {  // it has taken steps of its own
        load_state(lane, *leg.kernel);
      } else {
        load_duty(lane, *leg.kernel);
      }
    }
  }

  void hand_over(int lane) {
    const Seat& seat = seats_[lane];
    Leg& leg = *seat.leg;
    leg.together += row_ - seat.first;
    guarded(leg, [&] { leg.kernel->follow(track(seat, lane), state(lane), seat.sag_v); });
  }

  Track track(const Seat& seat, int lane) const {
    constexpr std::ptrdiff_t kRow = sizeof(typename Block::Row) / sizeof(double);
    const auto* first = reinterpret_cast<const double*>(&block_.rows[seat.first]) + lane;
    return {first, kRow, kWidth, row_ - seat.first};
  }

  StateVector state(int lane) const {
    StateVector out;
    for (int i = 0; i < kStates; ++i) out[i] = block_.x[i][lane];
    return out;
  }

  void load_robot(int lane, const Kernel& kernel) {
    seat_robot(block_, lane, kernel.plant(), 1e-6 * static_cast<double>(kernel.step_us()));
  }

  void load_state(int lane, const Kernel& kernel) {
    seat_state(block_, lane, kernel.state());
    load_duty(lane, kernel);
  }

  void load_duty(int lane, const Kernel& kernel) {
    for (int side = 0; side < 2; ++side) {
      block_.duty[side][lane] = kernel.drive().duty[side];
      block_.jam[side][lane] = kernel.drive().jam[side];
    }
    if (seats_[lane].loaded) set_loads(lane, {});  // those of before, or of another kernel
    seats_[lane].loaded = kernel.acted_on();
    seats_[lane].sag_v = 0.0;
  }

  void set_loads(int lane, const Kernel::StepLoads& loads) {
    for (int at = 0; at < 3; ++at) {
      for (int load = 0; load < kLoads; ++load) block_.loads[at][load][lane] = loads[at][load];
    }
  }

  // Of the step that is about to be taken.
  void load_loads(int lane) {
    Seat& seat = seats_[lane];
    const Kernel& kernel = *seat.leg->kernel;
    if (!kernel.disturbed()) return;  // a jam alone
    const std::int64_t t_us = kernel.time_us() + (row_ - seat.first) * kernel.step_us();
    const Kernel::StepLoads loads = kernel.step_loads(t_us, block_.x[kX][lane], block_.x[kY][lane]);
    set_loads(lane, loads);
    seat.sag_v = loads[2][kBatterySag];
  }

  // What an empty lane computes has to be some robot's motion, for its speed alone.
  void spread(int lane) {
    auto* const numbers = reinterpret_cast<V*>(&block_);
    constexpr std::size_t kNumbers = offsetof(Block, rows) / sizeof(V);
    for (std::size_t i = 0; i < kNumbers; ++i) {
      const double one = numbers[i][lane];
      for (int other = 0; other < kWidth; ++other) numbers[i][other] = one;
    }
    filled_ = true;
  }

  LaneRun run_;
  Leg* legs_;
  std::vector<std::size_t> order_;
  std::size_t next_ = 0;
  int row_ = 0;
  bool filled_ = false;
  std::array<Seat, kWidth> seats_{};
  Block block_;
};

// The longest way first: its lane would be the last one, alone.
std::vector<std::size_t> longest_first(const Leg* legs, std::size_t n) {
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return legs[a].t_us - legs[a].kernel->time_us() > legs[b].t_us - legs[b].kernel->time_us();
  });
  return order;
}

}  // namespace

std::vector<Width> widths() {
  std::vector<Width> out = {Width::kOne, Width::kTwo};
#ifdef TWIN_WIDE_LANES
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) out.push_back(Width::kFour);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl")) {
    out.push_back(Width::kEight);
  }
#endif
  return out;
}

void require_width(Width width) {
  const std::vector<Width> has = widths();
  if (std::find(has.begin(), has.end(), width) == has.end()) {
    throw std::invalid_argument("this processor has no registers of that width");
  }
}

void advance_together(Leg* legs, std::size_t n) {
  static const Width widest = widths().back();
  advance_together(legs, n, widest);
}

void advance_together(Leg* legs, std::size_t n, Width width) {
  require_width(width);
  for (std::size_t i = 0; i < n; ++i) {
    legs[i].failed = nullptr;
    legs[i].together = 0;
  }
  std::vector<std::size_t> order = longest_first(legs, n);
#ifdef TWIN_WIDE_LANES
  if (width == Width::kEight && order.size() > 4) order = Lanes<8>(run_eight, legs, std::move(order)).run();
  if (width >= Width::kFour && order.size() > 2) order = Lanes<4>(run_four, legs, std::move(order)).run();
#endif
  if (width >= Width::kTwo && order.size() > 1) order = Lanes<2>(run_two, legs, std::move(order)).run();
  for (const std::size_t i : order) alone(legs[i]);
}

void directions(Width width, const double* angle_rad, double* cos, double* sin, std::size_t n) {
  require_width(width);
  const auto lanes = static_cast<std::size_t>(width);
  if (n % lanes != 0) throw std::invalid_argument("a whole number of registers full");
  LaneDirect direct = direct_two;
#ifdef TWIN_WIDE_LANES
  if (width == Width::kFour) direct = direct_four;
  if (width == Width::kEight) direct = direct_eight;
#endif
  for (std::size_t i = 0; i < n; i += lanes) {
    if (width != Width::kOne) {
      direct(angle_rad + i, cos + i, sin + i);
      continue;
    }
    const Direction<double> to = direction(angle_rad[i]);
    cos[i] = to.cos;
    sin[i] = to.sin;
  }
}

}  // namespace twin
