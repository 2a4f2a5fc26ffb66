// The equations of plant.hpp, written once: for one robot, whose left and right share a register, and for
// several robots side by side, each in a lane of wider ones (lanes.hpp). `M` brings the numbers: `Number` (one of
// a robot), `Pair` (left and right), `Flag` (yes or no of a robot) and what has no operator. Every formula
// keeps the order of its operations, so that all round alike.
//
// Code for a processor's wider registers must not be shared with code that runs everywhere: all of this is
// inlined, and `M` belongs to the unit that is compiled.
#pragma once

#include "plant.hpp"

namespace twin {

constexpr double kGravity = 9.81;  // m/s^2
// What is left of a speed or a current that dies away: far below anything that acts on the rest, and
// still far above the numbers that processors take a hundred times longer for, squared too. Without an
// end a robot at rest would be computed in those for ever.
constexpr double kNothing = 1e-100;

// The states two by two, as the integration works on them.
enum PairIndex : int {
  kPosition,  // X, Y
  kTurn,      // theta, theta_dot
  kEta,       // eta1, eta2
  kCurrent,
  kWheel,
  kOmega,    // left, right
  kBattery,  // charge, nothing
  kPairs
};
template <class P>
struct PairedState {
  P v[kPairs];
  TWIN_INLINE P& operator[](int i) { return v[i]; }
  TWIN_INLINE const P& operator[](int i) const { return v[i]; }
};

// Squared angle from which a turn within one step is no longer small.
constexpr double kFarTurn2_rad2 = 1e-5;
// 1 - cos and sin of such a turn.
[[gnu::cold, gnu::noinline]] void turn_far(double by_rad, double& less, double& s);
// Torque of a brake at one wheel; smooth_rad_s: wheel speed below which friction softens.
double brake_torque(double torque_n_m, double omega_rad_s, double smooth_rad_s);

template <class M, Acts kActs>
struct Model {
  using N = typename M::Number;
  using P = typename M::Pair;
  static constexpr bool kPlain = kActs == Acts::kNothing;

  using State = PairedState<P>;
  using Loads = typename M::Loads;  // by Load
  struct Sides {                    // left, right
    P current_dot;                  // A/s, one motor
    P rim_n;  // what all motors of the side push the floor with, friction, load and rolling taken off
  };
  struct Friction {
    P bridge_sign,
        slide_sign;  // soft signs: of the currents (left, right), of the axles' sliding (front, rear)
    P dry_n;         // of motors, gears and rolling, at the rims
  };
  struct Acceleration {
    N eta1_dot, eta2_dot, theta_ddot;  // m/s^2, m/s^2, rad/s^2, body frame
    P omega_dot;                       // rad/s^2
  };
  using Heading = Direction<N>;
  struct Length {  // of a step in s, half of it, a sixth of it
    N whole, half, sixth;
  };

  const Terms<N>& t;
  const P& duty;
  const P& jam;
  typename M::Flag castor;
  bool slip = false, lifted = false;

  // Friction scaled by a change of it: there is none below -1, least of all one that drives.
  TWIN_INLINE static N grip(const Loads& load) { return M::not_negative(1.0 + load[kFrictionChange]); }

  // x + h dx
  TWIN_INLINE static State moved(const State& x, const N& h, const State& dx) {
    State out;
    for (int i = 0; i < kPairs; ++i) out[i] = x[i] + h * dx[i];
    return out;
  }

  // Within a step the heading turns by some 1e-4 rad: the series is exact to the last bit there, at a
  // fraction of the functions' cost.
  TWIN_INLINE static Heading turned(const Heading& from, const N& by_rad) {
    const N d2 = by_rad * by_rad;
    N less = d2 * (0.5 - d2 * (1.0 / 24.0));  // 1 - cos
    N s = by_rad * (1.0 - d2 * (1.0 / 6.0 - d2 * (1.0 / 120.0)));
    M::turn_where_far(by_rad, d2, less, s);
    return {from.cos - (from.cos * less + from.sin * s), from.sin - (from.sin * less - from.cos * s)};
  }

  // Whether the wheels roll and the axles' middle keeps its place: then eta2, the wheels' speeds and their rates
  // follow from eta1 and theta_dot.
  TWIN_INLINE bool rolls() const { return kActs != Acts::kAll || (!slip && !lifted); }

  // Speeds of the rims of wheels that roll, or their rates.
  TWIN_INLINE P rims(const N& eta1, const N& w) const {
    return eta1 + M::pair(-t.half_track_m, t.half_track_m) * w;
  }

  // The bridge draws duty * current from the battery (power in = power out, drop taken at the motor).
  TWIN_INLINE N draw_a(const P& current_a) const {
    return t.battery_idle_a + t.motor_per_side * sum(duty * current_a);
  }

  TWIN_INLINE N battery_v(const N& charge_ratio, const N& draw_a, const N& sag_v) const {
    const N open_v = t.battery_empty_v + t.battery_span_v * charge_ratio;
    // A sag above what is there leaves nothing; it does not reverse the motors.
    return M::not_negative(open_v - t.battery_resistance_ohm * draw_a - sag_v);
  }

  // All that has a sign with a soft middle, v / root(v^2 + v_s^2): 0.71 at v = v_s, 0.995 at 10 v_s. All of it has
  // one quotient, which does not wait for the roots: v / root(a) is v root(a) b / (a b), and a factor of what friction
  // falls by, 1 / (1 + (v / v_stribeck)^2), stands below the line too. roll_n: rolling resistance of a side.
  TWIN_INLINE Friction friction(const P& current_a, const P& rim_m_s, const P& slide_m_s,
                                const N& roll_n) const {
    const P bridge2 = current_a * current_a + t.bridge_smoothing2_a2;
    const P slide2 = slide_m_s * slide_m_s + t.floor_smoothing2_m2_s2;
    const P rim2 = rim_m_s * rim_m_s, roll2 = rim2 + t.floor_smoothing2_m2_s2;
    const P stribeck2 = rim2 + t.stribeck2_m2_s2;
    const P others2 = bridge2 * slide2, dry2 = roll2 * stribeck2;
    const P per_all = M::inverse(dry2 * others2);
    // Gear loss is friction in proportion to load: eta_g k_t N i when driving, as printed, and no
    // gain of energy when the wheel drives the motor, where eta_g would have to divide.
    const P steady_n = (t.coulomb_n + roll_n) + t.loss_n_a * M::magnitude(current_a);
    const P dry_n = steady_n * stribeck2 + t.stribeck_n_m2_s2;  // times stribeck2
    return {current_a * slide2 * dry2 * M::root(bridge2) * per_all,
            slide_m_s * bridge2 * dry2 * M::root(slide2) * per_all,
            rim_m_s * dry_n * others2 * M::root(roll2) * per_all};
  }

  // Motor, bridge and gear of both sides (2.11).
  TWIN_INLINE Sides sides(const P& current_a, const P& rim_m_s, const Friction& f, const Loads& load,
                          const N& supply_v) const {
    Sides out;
    out.current_dot = t.per_inductance * (duty * supply_v - t.emf_v_s_m * rim_m_s -
                                          t.resistance_ohm * current_a - t.bridge_drop_v * f.bridge_sign);
    out.rim_n = t.drive_n_a * current_a - t.viscous_n_s_m * rim_m_s - f.dry_n;
    if constexpr (!kPlain) {
      const P omega_rad_s = rim_m_s * t.per_radius;
      const P brake_n_m = M::brakes(M::pair(load[kBrakeLeft], load[kBrakeRight]), omega_rad_s,
                                    t.floor_smoothing_m_s * t.per_radius);
      const P load_n_m = jam * omega_rad_s + M::pair(load[kLoadLeft], load[kLoadRight]) + brake_n_m;
      out.rim_n = out.rim_n - load_n_m * t.per_radius;
    }
    return out;
  }

  TWIN_INLINE State derivative(const State& x, const Heading& at, const Loads& load) const {
    const N drawn_a = draw_a(x[kCurrent]);
    const N supply_v = battery_v(x[kBattery][0], drawn_a, load[kBatterySag]);
    const N c = at.cos, s = at.sin;
    const N eta1 = x[kEta][0], w = x[kTurn][1];
    const N eta2 = rolls() ? -t.d0_m * w : x[kEta][1];
    const P rim_m_s = rolls() ? rims(eta1, w) : t.wheel_radius_m * x[kOmega];
    // Weight along the floor, body frame, small-angle floor (loads on the axles unchanged).
    const N gx = -kGravity * load[kSlopeX], gy = -kGravity * load[kSlopeY];
    const N gravity[2] = {c * gx + s * gy, c * gy - s * gx};
    const N roll_n = kPlain ? t.roll_n : lifted ? N{} : grip(load) * t.roll_n;
    const P slide_m_s = rolls() ? M::pair(t.front_arm_m, -t.rear_arm_m) * w : M::pair(N{}, N{});

    const Friction f = friction(x[kCurrent], rim_m_s, slide_m_s, roll_n);
    const Sides both = sides(x[kCurrent], rim_m_s, f, load, supply_v);
    Acceleration acc;
    if (rolls()) {
      acc = constrained(x, both, f.slide_sign, load, gravity);
    } else if constexpr (kActs == Acts::kAll) {
      acc = lifted ? hanging(both) : slipping(x, both, load, gravity);
    }
    State out;
    out[kPosition] = M::pair(c * eta1 - s * eta2, s * eta1 + c * eta2);
    out[kTurn] = M::pair(w, acc.theta_ddot);
    out[kEta] = M::pair(acc.eta1_dot, acc.eta2_dot);
    out[kCurrent] = both.current_dot;
    out[kWheel] = rolls() ? rim_m_s * t.per_radius : x[kOmega];
    out[kOmega] = acc.omega_dot;
    out[kBattery] = M::pair(-t.per_charge * drawn_a, x[kBattery][1]);
    return out;
  }

  // Rolling wheels and eta2 = -d0 theta_dot: (S'MS) eta_dot = S'(G tau - F - M S_dot eta), written
  // for (eta1, theta_dot), with the inertia of wheels and rotors in both. slide_sign: of the axles' lateral speeds.
  TWIN_INLINE Acceleration constrained(const State& x, const Sides& both, const P& slide_sign,
                                       const Loads& load, const N* gravity) const {
    const N w = x[kTurn][1], eta1 = x[kEta][0];
    P scrub_n_m = M::pair(t.front_arm_m * t.slide_front_n, -t.rear_arm_m * t.slide_rear_n);
    if constexpr (!kPlain) scrub_n_m = grip(load) * scrub_n_m;

    N forward_n = sum(both.rim_n) - t.mass_arm_kg_m * (w * w);
    N turn_n_m = t.mass_arm_kg_m * (eta1 * w) - sum(scrub_n_m * slide_sign);
    if constexpr (!kPlain) {
      forward_n = forward_n + (load[kForceForward] + t.mass_kg * gravity[0]);
      turn_n_m = turn_n_m + (load[kTorqueYaw] - t.d0_m * (load[kForceLeft] + t.mass_kg * gravity[1]));
    }
    N moment_n_m = t.half_track_m * (both.rim_n[1] - both.rim_n[0]) + turn_n_m;
    Acceleration acc;
    // Adding 0 is not nothing: it makes -0 that which it would be with forces of 0 before.
    acc.eta1_dot = forward_n * t.per_mass_rim + load[kAccForward];
    if (M::any(castor)) {
      const P drag_n = castor_drag(M::pair(eta1, -t.rear_arm_m * w), load, t.floor_smoothing2_m2_s2);
      acc.eta1_dot = M::choose(castor, acc.eta1_dot - drag_n[0] * t.per_mass_rim, acc.eta1_dot);
      // on the arm from the point without lateral speed
      moment_n_m = M::choose(castor, moment_n_m + t.rear_arm_m * drag_n[1], moment_n_m);
    }
    acc.theta_ddot = moment_n_m * t.per_inertia_rim + load[kAccYaw];
    if constexpr (!kPlain) acc.theta_ddot = acc.theta_ddot - load[kAccLateral] / t.d0_m;
    acc.eta2_dot = -t.d0_m * acc.theta_ddot;
    acc.omega_dot = rims(acc.eta1_dot, acc.theta_ddot) * t.per_radius;
    return acc;
  }

  // Four Coulomb contacts: each pushes against the slip velocity of its patch, so that sliding
  // sideways takes grip from driving and the other way round.
  Acceleration slipping(const State& x, const Sides& both, const Loads& load, const N* gravity) const {
    const N &m = t.mass_kg, &r = t.wheel_radius_m, &half = t.half_track_m;
    const N w = x[kTurn][1], eta1 = x[kEta][0], eta2 = x[kEta][1];
    const N v_s = t.floor_slip_smoothing_m_s, grip_ratio = grip(load);
    const N axle_x[2] = {t.front_axle_m, -t.rear_axle_m};
    const N wheel_n[2] = {0.5 * grip_ratio * t.slide_front_n, 0.5 * grip_ratio * t.slide_rear_n};
    const P y = M::pair(half, -half);
    const P slip_x = eta1 - y * w - r * x[kOmega];
    P drive_n = M::pair(N{}, N{}), side_n = M::pair(N{}, N{});
    N moment{};
    for (int axle = 0; axle < 2; ++axle) {
      const N slip_y = eta2 + axle_x[axle] * w;
      const P share = wheel_n[axle] / M::root(slip_x * slip_x + slip_y * slip_y + v_s * v_s);
      drive_n = drive_n - share * slip_x;
      side_n = side_n - share * slip_y;
      moment = moment - axle_x[axle] * sum(share) * slip_y;
    }
    moment = moment - sum(y * drive_n);
    P body_n = M::pair(sum(drive_n), sum(side_n));
    if (M::any(castor)) {
      const P foot_m_s = x[kEta] + M::pair(N{}, -t.rear_axle_m * w);
      const P drag_n = castor_drag(foot_m_s, load, v_s * v_s);
      body_n = M::choose(castor, body_n - drag_n, body_n);
      moment = M::choose(castor, moment + t.rear_axle_m * drag_n[1], moment);
    }
    Acceleration acc;
    acc.omega_dot = r * (both.rim_n - drive_n) / t.side_inertia_kg_m2;
    acc.eta1_dot = (body_n[0] + load[kForceForward]) / m + gravity[0] + eta2 * w + load[kAccForward];
    acc.eta2_dot = (body_n[1] + load[kForceLeft]) / m + gravity[1] - eta1 * w + load[kAccLateral];
    acc.theta_ddot = (moment + load[kTorqueYaw]) / t.inertia_kg_m2 + load[kAccYaw];
    return acc;
  }

  // Friction against the motion of the castor's foot over the floor, alike in every direction.
  TWIN_INLINE P castor_drag(const P& foot_m_s, const Loads& load, const N& v_s2) const {
    const N v2 = foot_m_s[0] * foot_m_s[0] + foot_m_s[1] * foot_m_s[1];
    const N limit_n = kPlain ? t.castor_n : grip(load) * t.castor_n;
    return limit_n / M::root(v2 + v_s2) * foot_m_s;
  }

  // On blocks: each side turns its own wheels and rotors, and nothing pushes the body.
  Acceleration hanging(const Sides& both) const {
    return {N{}, N{}, N{}, t.wheel_radius_m * both.rim_n / t.side_inertia_kg_m2};
  }

  // One step of Runge-Kutta's fourth order.
  TWIN_INLINE State advanced(const State& x, const Length& h, const Loads& begin, const Loads& middle,
                             const Loads& end) const {
    const Heading at = Directions<M>::of(x[kTurn][0]);
    const auto slope = [&](const State& there, const Loads& load) __attribute__((always_inline)) {
      return derivative(there, turned(at, there[kTurn][0] - x[kTurn][0]), load);
    };
    const State k1 = derivative(x, at, begin);
    const State k2 = slope(moved(x, h.half, k1), middle);
    const State k3 = slope(moved(x, h.half, k2), middle);
    const State k4 = slope(moved(x, h.whole, k3), end);
    State next;
    for (int i = 0; i < kPairs; ++i) {
      next[i] = x[i] + h.sixth * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
    }
    if (rolls()) {
      next[kEta] = M::pair(next[kEta][0], -t.d0_m * next[kTurn][1]);
      next[kOmega] = rims(next[kEta][0], next[kTurn][1]) * t.per_radius;
    }
    next[kTurn] = M::pair(next[kTurn][0], settled(next[kTurn][1]));
    for (const int i : {kEta, kCurrent, kOmega}) next[i] = settled(next[i]);
    return next;
  }

  template <class V>
  TWIN_INLINE static V settled(const V& v) {
    return M::zero_where_below(M::magnitude(v), kNothing, v);
  }
};

}  // namespace twin
