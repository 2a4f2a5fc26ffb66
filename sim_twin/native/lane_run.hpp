// The steps of one width, compiled for the processors that have it: a unit defines TWIN_LANES (robots side by
// side), TWIN_ROOT (square roots of a register), TWIN_PROVEN_ROOT where it has another way to them that may fail,
// TWIN_RUN and TWIN_DIRECT (the functions' names), and takes this in. All but those functions belongs to the unit alone.
#include <cmath>
#include <cstring>

#include "lane_block.hpp"

namespace twin {
namespace {

using Block = LaneBlock<TWIN_LANES>;
using V = Block::V;

// Left and right of every robot.
struct Two {
  V v[2];
  TWIN_INLINE const V& operator[](int side) const { return v[side]; }
};

#define TWIN_EACH(op)                                                                                        \
  TWIN_INLINE Two operator op(const Two& a, const Two& b) { return {{a.v[0] op b.v[0], a.v[1] op b.v[1]}}; } \
  TWIN_INLINE Two operator op(const V& a, const Two& b) { return {{a op b.v[0], a op b.v[1]}}; }             \
  TWIN_INLINE Two operator op(const Two& a, const V& b) { return {{a.v[0] op b, a.v[1] op b}}; }             \
  TWIN_INLINE Two operator op(double a, const Two& b) { return {{a op b.v[0], a op b.v[1]}}; }
TWIN_EACH(+)
TWIN_EACH(-)
TWIN_EACH(*)
TWIN_EACH(/)
#undef TWIN_EACH
TWIN_INLINE V sum(const Two& a) { return a.v[0] + a.v[1]; }

using Mask = decltype(V{} < V{});
typedef std::uint64_t Bits __attribute__((vector_size(sizeof(V))));

TWIN_INLINE bool any_of(const Mask& mask) {
  long long any = 0;
  for (int lane = 0; lane < TWIN_LANES; ++lane) any |= mask[lane];
  return any != 0;
}

template <bool kCastors>
struct Many {
  using Number = V;
  using Pair = Two;
  using Flag = Mask;
  using Bits = twin::Bits;
  struct Loads {
    V v[kLoads];
    TWIN_INLINE const V& operator[](int load) const { return v[load]; }
  };

  TWIN_INLINE static Two pair(const V& first, const V& second) { return {{first, second}}; }
  TWIN_INLINE static Bits bits_of(const V& v) { return (Bits)v; }
  TWIN_INLINE static V number_of(const Bits& bits) { return (V)bits; }
  TWIN_INLINE static V root(const V& v) { return TWIN_ROOT(v); }
  // Where there is another way than the divider, one half goes each way.
  TWIN_INLINE static Two root(const Two& v) {
#ifdef TWIN_PROVEN_ROOT
    Two out;
    const bool sure = TWIN_PROVEN_ROOT(v.v[1], out.v[1]);
    out.v[0] = TWIN_ROOT(v.v[0]);
    if (__builtin_expect(sure, true)) return out;
#endif
    return {{TWIN_ROOT(v.v[0]), TWIN_ROOT(v.v[1])}};
  }
  TWIN_INLINE static Two inverse(const Two& v) { return 1.0 / v; }
  TWIN_INLINE static V magnitude(const V& v) {
    const Mask rest = (Mask)(V{} - 0.0) | 0x7fffffffffffffffLL;
    return (V)((Mask)v & rest);
  }
  TWIN_INLINE static Two magnitude(const Two& v) { return {{magnitude(v.v[0]), magnitude(v.v[1])}}; }
  TWIN_INLINE static V not_negative(const V& v) { return v < 0.0 ? V{} : v; }
  TWIN_INLINE static bool any(const Mask&) { return kCastors; }
  TWIN_INLINE static V choose(const Mask& flag, const V& yes, const V& no) { return flag ? yes : no; }
  TWIN_INLINE static V zero_where_below(const V& size, double limit, const V& v) {
    return size < limit ? V{} : v;
  }
  TWIN_INLINE static Two zero_where_below(const Two& size, double limit, const Two& v) {
    return {{zero_where_below(size.v[0], limit, v.v[0]), zero_where_below(size.v[1], limit, v.v[1])}};
  }
  TWIN_INLINE static Two brakes(const Two& torque_n_m, const Two& omega_rad_s, const V& smooth_rad_s) {
    Two out{};
    for (int side = 0; side < 2; ++side) {
      if (!any_of(torque_n_m[side] > 0.0)) continue;
      for (int lane = 0; lane < TWIN_LANES; ++lane) {
        out.v[side][lane] = brake_torque(torque_n_m[side][lane], omega_rad_s[side][lane], smooth_rad_s[lane]);
      }
    }
    return out;
  }
  TWIN_INLINE static void turn_where_far(const V& by_rad, const V& d2, V& less, V& s) {
    const Mask near = d2 < kFarTurn2_rad2;
    if (!any_of(~near)) return;
    for (int lane = 0; lane < TWIN_LANES; ++lane) {
      if (near[lane]) continue;
      double less_one = 0.0, s_one = 0.0;
      turn_far(by_rad[lane], less_one, s_one);
      less[lane] = less_one;
      s[lane] = s_one;
    }
  }
  TWIN_INLINE static void direct_where_far(const V& angle_rad, const V& size_rad, Direction<V>& out) {
    const Mask near = size_rad < kNear_rad;
    if (__builtin_expect(!any_of(~near), true)) return;
    for (int lane = 0; lane < TWIN_LANES; ++lane) {
      if (near[lane]) continue;
      const Direction<double> one = direction_far(angle_rad[lane]);
      out.cos[lane] = one.cos;
      out.sin[lane] = one.sin;
    }
  }
};

// With loads the castor's part is always worked out, for those that have one.
template <bool kCastors, Acts kActs>
TWIN_INLINE void run(Block& block, int first, int steps) {
  using Lanes = Model<Many<kCastors>, kActs>;
  typename Many<kCastors>::Loads loads[3] = {};
  if (kActs == Acts::kLoads) {
    for (int at = 0; at < 3; ++at) {
      for (int load = 0; load < kLoads; ++load) loads[at].v[load] = block.loads[at][load];
    }
  }
  const Two duty{{block.duty[0], block.duty[1]}}, jam{{block.jam[0], block.jam[1]}};
  const Lanes model{block.terms, duty, jam, block.castor != 0.0};
  V* const x = block.x;
  PairedState<Two> now{{{{x[kX], x[kY]}},
                        {{x[kTheta], x[kThetaDot]}},
                        {{x[kEta1], x[kEta2]}},
                        {{x[kCurrentL], x[kCurrentR]}},
                        {{x[kWheelL], x[kWheelR]}},
                        {{x[kOmegaL], x[kOmegaR]}},
                        {{x[kCharge], V{}}}}};
  V safe = V{} + 1.0;
  for (int step = first; step < first + steps; ++step) {
    now = model.advanced(now, {block.h_s, block.half_h_s, block.sixth_h_s}, loads[0], loads[1], loads[2]);
    const Two size = Many<kCastors>::magnitude(now[kOmega]);
    safe = size[0] + size[1] < kRunaway_rad_s ? safe : V{};
    block.rows[step] = {now[kPosition][0], now[kPosition][1], now[kTurn][0], now[kWheel][0], now[kWheel][1]};
  }
  constexpr int kFirst[kPairs] = {kX, kTheta, kEta1, kCurrentL, kWheelL, kOmegaL, kCharge};
  constexpr int kSecond[kPairs] = {kY, kThetaDot, kEta2, kCurrentR, kWheelR, kOmegaR, -1};
  for (int i = 0; i < kPairs; ++i) {
    x[kFirst[i]] = now[i][0];
    if (kSecond[i] >= 0) x[kSecond[i]] = now[i][1];
  }
  block.diverged = safe == 0.0 ? V{} + 1.0 : block.diverged;
}

}  // namespace

void TWIN_RUN(void* at, int first, int steps, bool loaded) {
  Block& block = *static_cast<Block*>(at);
  if (loaded) {
    run<true, Acts::kLoads>(block, first, steps);
  } else if (any_of(block.castor != 0.0)) {
    run<true, Acts::kNothing>(block, first, steps);
  } else {
    run<false, Acts::kNothing>(block, first, steps);
  }
}

void TWIN_DIRECT(const double* angle_rad, double* cos, double* sin) {
  V angle;
  std::memcpy(&angle, angle_rad, sizeof angle);
  const Direction<V> to = Directions<Many<false>>::of(angle);
  std::memcpy(cos, &to.cos, sizeof to.cos);
  std::memcpy(sin, &to.sin, sizeof to.sin);
}

}  // namespace twin
