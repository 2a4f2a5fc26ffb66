#include "plant.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace twin {
namespace {

constexpr double kGravity = 9.81;  // m/s^2
// Slope of a brake's torque through rest, as stiff as a jam of the gears (kernel.cpp).
constexpr double kStiffest_n_m_s_rad = 12.0;

// What is left of a speed or a current that dies away: far below anything that acts on the rest, and
// still far above the numbers that processors take a hundred times longer for, squared too. Without an
// end a robot at rest would be computed in those for ever.
constexpr double kNothing = 1e-100;

inline Pair settled(Pair v) { return magnitude(v) < kNothing ? Pair{0.0, 0.0} : v; }

// Sign with a soft middle: 0.71 at v = v_s, 0.995 at 10 v_s.
inline Pair soft_sign(Pair v, double v_s) { return v / root(v * v + v_s * v_s); }

// Friction scaled by a change of it: there is none below -1, least of all one that drives.
inline double grip(const LoadVector& load) { return std::max(1.0 + load[kFrictionChange], 0.0); }

// x + h dx
inline PairedState moved(const PairedState& x, double h, const PairedState& dx) {
  PairedState out;
  for (int i = 0; i < kPairs; ++i) out[i] = x[i] + h * dx[i];
  return out;
}

PairedState paired(const StateVector& x) {
  return {Pair{x[kX], x[kY]},           Pair{x[kTheta], x[kThetaDot]},
          Pair{x[kEta1], x[kEta2]},     Pair{x[kCurrentL], x[kCurrentR]},
          Pair{x[kWheelL], x[kWheelR]}, Pair{x[kOmegaL], x[kOmegaR]},
          Pair{x[kCharge], 0.0}};
}

StateVector listed(const PairedState& x) {
  return {x[kPosition][0], x[kPosition][1], x[kTurn][0],    x[kEta][0],   x[kEta][1],
          x[kTurn][1],     x[kCurrent][0],  x[kCurrent][1], x[kWheel][0], x[kWheel][1],
          x[kOmega][0],    x[kOmega][1],    x[kBattery][0]};
}

}  // namespace

Plant::Plant(const PlantParams& params) : p_(params), d_(derive(params)) { reset(0.0, 0.0, 0.0); }

Plant::Derived Plant::derive(const PlantParams& p) {
  const double rotor = p.motor_gear_ratio * p.motor_gear_ratio * p.motor_rotor_inertia_kg_m2;
  const double wheelbase_m = p.front_axle_m + p.rear_axle_m;
  Derived d{};
  d.per_radius = 1.0 / p.wheel_radius_m;
  d.per_inductance = 1.0 / p.motor_inductance_h;
  d.per_stribeck = 1.0 / p.motor_stribeck_rad_s;
  d.per_charge = 1.0 / (3600.0 * p.battery_capacity_a_h);
  d.side_inertia = p.motor_per_side * rotor + (p.castor ? 1.0 : 2.0) * p.wheel_inertia_kg_m2;
  d.emf_v_s = p.motor_emf_constant_v_s_rad * p.motor_gear_ratio;
  d.gear_n_m_a = p.motor_torque_constant_n_m_a * p.motor_gear_ratio;
  d.weight_n = p.mass_kg * kGravity;
  d.roll_n = 0.5 * p.floor_rolling_ratio * d.weight_n;
  d.slide_front_n = p.floor_friction_ratio * d.weight_n * p.rear_axle_m / wheelbase_m;
  d.slide_rear_n = p.floor_friction_ratio * d.weight_n * p.front_axle_m / wheelbase_m;
  d.castor_n = 0.0;
  if (p.castor) {  // it has the rear axle's load and neither its grip nor its rolling resistance
    const double castor_ratio = p.front_axle_m / wheelbase_m;
    d.roll_n *= 1.0 - castor_ratio;
    d.slide_rear_n = 0.0;
    d.castor_n = p.castor_friction_ratio * d.weight_n * castor_ratio;
  }
  const double rim_kg = 2.0 * d.side_inertia * d.per_radius * d.per_radius;
  d.per_mass_rim = 1.0 / (p.mass_kg + rim_kg);
  d.per_inertia_rim =
      1.0 / (p.inertia_kg_m2 + p.mass_kg * p.d0_m * p.d0_m + 0.25 * p.track_m * p.track_m * rim_kg);
  return d;
}

void Plant::reset(double x_m, double y_m, double theta_rad) {
  x_.fill(0.0);
  rest_.holds = false;
  x_[kX] = x_m;
  x_[kY] = y_m;
  x_[kTheta] = theta_rad;
  x_[kCharge] = p_.battery_charge_start_ratio;
}

Pair Plant::rolling(double eta1, double w) const {
  return (eta1 + Pair{-0.5, 0.5} * p_.track_m * w) * d_.per_radius;
}

// The bridge draws duty * current from the battery (power in = power out, drop taken at the motor).
double Plant::draw_a(Pair current_a, const Drive& drive) const {
  return p_.battery_idle_a + p_.motor_per_side * sum(drive.duty * current_a);
}

double Plant::battery_v(double charge_ratio, double draw_a, double sag_v) const {
  const double open_v = p_.battery_empty_v + (p_.battery_full_v - p_.battery_empty_v) * charge_ratio;
  // A sag above what is there leaves nothing; it does not reverse the motors.
  return std::max(open_v - p_.battery_resistance_ohm * draw_a - sag_v, 0.0);
}

double Plant::battery_v(const Drive& drive, double sag_v) const {
  return battery_v(x_[kCharge], draw_a(Pair{x_[kCurrentL], x_[kCurrentR]}, drive), sag_v);
}

double Plant::charge_after(double h_s, const Drive& drive) const {
  const Pair current_a = {x_[kCurrentL], x_[kCurrentR]};
  return x_[kCharge] - h_s * d_.per_charge * draw_a(current_a, drive);
}

// Torque of a brake: against the motion, with the soft middle of all friction here; softer for a strong
// one, so that it is never stiffer than kStiffest.
double Plant::brake(double torque_n_m, double omega_rad_s) const {
  if (!(torque_n_m > 0.0)) return 0.0;
  const double soft_rad_s =
      std::max(p_.floor_smoothing_m_s * d_.per_radius, torque_n_m / kStiffest_n_m_s_rad);
  return torque_n_m * omega_rad_s / std::hypot(omega_rad_s, soft_rad_s);
}

// Motor, bridge and gear of both sides (2.11).
template <bool kPlain>
Plant::Sides Plant::sides(Pair current_a, Pair omega_rad_s, const Drive& drive, const LoadVector& load,
                          double battery_v) const {
  const Pair channel_a = p_.motor_per_side * current_a;
  const Pair drop_v =
      p_.bridge_drop_v * soft_sign(channel_a, p_.bridge_smoothing_a) + p_.bridge_resistance_ohm * channel_a;
  const Pair gear_n_m = d_.gear_n_m_a * current_a;
  const Pair sign = soft_sign(omega_rad_s * p_.wheel_radius_m, p_.floor_smoothing_m_s);
  const Pair ratio = omega_rad_s * d_.per_stribeck;
  // Gear loss is friction in proportion to load: eta_g k_t N i when driving, as printed, and no
  // gain of energy when the wheel drives the motor, where eta_g would have to divide.
  const Pair coulomb_n_m = p_.motor_coulomb_n_m +
                           (p_.motor_stiction_n_m - p_.motor_coulomb_n_m) / (1.0 + ratio * ratio) +
                           (1.0 - p_.motor_gear_efficiency_ratio) * magnitude(gear_n_m);
  const Pair friction_n_m = sign * coulomb_n_m + p_.motor_viscous_n_m_s_rad * omega_rad_s;
  Sides out;
  out.current_dot = d_.per_inductance * (drive.duty * battery_v - drop_v - d_.emf_v_s * omega_rad_s -
                                         p_.motor_resistance_ohm * current_a);
  out.torque_n_m = p_.motor_per_side * (gear_n_m - friction_n_m);
  if (!kPlain) {
    const Pair brake_n_m = {brake(load[kBrakeLeft], omega_rad_s[0]),
                            brake(load[kBrakeRight], omega_rad_s[1])};
    out.torque_n_m =
        out.torque_n_m - drive.jam * omega_rad_s - Pair{load[kLoadLeft], load[kLoadRight]} - brake_n_m;
  }
  out.rolling_sign = sign;
  return out;
}

Plant::Heading Plant::heading(double theta_rad) { return {std::cos(theta_rad), std::sin(theta_rad)}; }

// Within a step the heading turns by some 1e-4 rad: the series is exact to the last bit there, at a
// fraction of the functions' cost.
Plant::Heading Plant::turned(const Heading& from, double by_rad) {
  const double d2 = by_rad * by_rad;
  if (!(d2 < 1e-5)) return turned_far(from, by_rad);
  const double less = d2 * (0.5 - d2 * (1.0 / 24.0 - d2 * (1.0 / 720.0)));  // 1 - cos
  const double s = by_rad * (1.0 - d2 * (1.0 / 6.0 - d2 * (1.0 / 120.0)));
  return {from.cos - (from.cos * less + from.sin * s), from.sin - (from.sin * less - from.cos * s)};
}

Plant::Heading Plant::turned_far(const Heading& from, double by_rad) {
  const double less = 1.0 - std::cos(by_rad), s = std::sin(by_rad);
  return {from.cos - (from.cos * less + from.sin * s), from.sin - (from.sin * less - from.cos * s)};
}

StateVector Plant::derivative(const StateVector& x, const Drive& drive, const LoadVector& load) const {
  return listed(derivative<false>(paired(x), heading(x[kTheta]), drive, load));
}

template <bool kPlain>
PairedState Plant::derivative(const PairedState& x, const Heading& at, const Drive& drive,
                              const LoadVector& load) const {
  const double drawn_a = draw_a(x[kCurrent], drive);
  const double supply_v = battery_v(x[kBattery][0], drawn_a, load[kBatterySag]);
  const Sides both = sides<kPlain>(x[kCurrent], x[kOmega], drive, load, supply_v);
  const double c = at.cos, s = at.sin;
  const double eta1 = x[kEta][0], eta2 = x[kEta][1];
  // Weight along the floor, body frame, small-angle floor (loads on the axles unchanged).
  const double gx = -kGravity * load[kSlopeX], gy = -kGravity * load[kSlopeY];
  const double gravity[2] = {c * gx + s * gy, c * gy - s * gx};

  Acceleration acc{0.0, 0.0, 0.0, Pair{0.0, 0.0}};
  if (kPlain) {
    acc = constrained<true>(x, both, load, gravity);
  } else if (p_.lifted) {
    acc = hanging(both);
  } else if (p_.slip) {
    acc = slipping(x, both, load, gravity);
  } else {
    acc = constrained<false>(x, both, load, gravity);
  }
  return {Pair{c * eta1 - s * eta2, s * eta1 + c * eta2},
          Pair{x[kTurn][1], acc.theta_ddot},
          Pair{acc.eta1_dot, acc.eta2_dot},
          both.current_dot,
          x[kOmega],
          acc.omega_dot,
          Pair{-d_.per_charge * drawn_a, 0.0}};
}

// Rolling wheels and eta2 = -d0 theta_dot: (S'MS) eta_dot = S'(G tau - F - M S_dot eta), written
// for (eta1, theta_dot), with the inertia of wheels and rotors in both.
template <bool kPlain>
Plant::Acceleration Plant::constrained(const PairedState& x, const Sides& both, const LoadVector& load,
                                       const double* gravity) const {
  const double m = p_.mass_kg, half = 0.5 * p_.track_m, d0 = p_.d0_m;
  const double w = x[kTurn][1], eta1 = x[kEta][0], eta2 = x[kEta][1];
  const double grip_ratio = kPlain ? 1.0 : grip(load);
  const Pair rim_n =
      both.torque_n_m * d_.per_radius - grip_ratio * d_.roll_n * both.rolling_sign;  // left, right

  const Pair axle_m = {p_.front_axle_m, -p_.rear_axle_m};
  const Pair slide_n = grip_ratio * Pair{d_.slide_front_n, d_.slide_rear_n} *
                       soft_sign(eta2 + axle_m * w, p_.floor_smoothing_m_s);
  const double lateral_n = sum(slide_n);           // F_y
  const double scrub_n_m = sum(axle_m * slide_n);  // in M_r

  double forward_n = sum(rim_n), turn_n_m = half * (rim_n[1] - rim_n[0]) - scrub_n_m, left_n = lateral_n;
  if (!kPlain) {
    forward_n += load[kForceForward] + m * gravity[0];
    turn_n_m += load[kTorqueYaw];
    left_n -= load[kForceLeft] + m * gravity[1];
  }
  Acceleration acc;
  // Adding 0 is not nothing: it makes -0 that which it would be with forces of 0 before.
  acc.eta1_dot = (forward_n + m * eta2 * w) * d_.per_mass_rim + (kPlain ? 0.0 : load[kAccForward]);
  double moment = turn_n_m + d0 * (left_n + m * eta1 * w);
  if (p_.castor) {
    const Pair drag_n = castor_drag(x, grip_ratio, p_.floor_smoothing_m_s);
    acc.eta1_dot -= drag_n[0] * d_.per_mass_rim;
    moment += (d0 + p_.rear_axle_m) * drag_n[1];  // on the arm from the point without lateral speed
  }
  acc.theta_ddot = moment * d_.per_inertia_rim + (kPlain ? 0.0 : load[kAccYaw]);
  if (!kPlain) acc.theta_ddot -= load[kAccLateral] / d0;
  acc.eta2_dot = -d0 * acc.theta_ddot;
  acc.omega_dot = rolling(acc.eta1_dot, acc.theta_ddot);
  return acc;
}

// Four Coulomb contacts: each pushes against the slip velocity of its patch, so that sliding
// sideways takes grip from driving and the other way round.
Plant::Acceleration Plant::slipping(const PairedState& x, const Sides& both, const LoadVector& load,
                                    const double* gravity) const {
  const double m = p_.mass_kg, r = p_.wheel_radius_m, half = 0.5 * p_.track_m;
  const double w = x[kTurn][1], eta1 = x[kEta][0], eta2 = x[kEta][1];
  const double v_s = p_.floor_slip_smoothing_m_s;
  const double axle_x[2] = {p_.front_axle_m, -p_.rear_axle_m};
  const double wheel_n[2] = {0.5 * grip(load) * d_.slide_front_n, 0.5 * grip(load) * d_.slide_rear_n};
  const Pair y = {half, -half};
  const Pair slip_x = eta1 - y * w - r * x[kOmega];
  Pair drive_n = {0.0, 0.0}, side_n = {0.0, 0.0};
  double moment = 0.0;
  for (int axle = 0; axle < 2; ++axle) {
    const double slip_y = eta2 + axle_x[axle] * w;
    const Pair share = wheel_n[axle] / root(slip_x * slip_x + slip_y * slip_y + v_s * v_s);
    drive_n -= share * slip_x;
    side_n -= share * slip_y;
    moment -= axle_x[axle] * sum(share) * slip_y;
  }
  moment -= sum(y * drive_n);
  Pair body_n = {sum(drive_n), sum(side_n)};
  if (p_.castor) {
    const Pair drag_n = castor_drag(x, grip(load), v_s);
    body_n -= drag_n;
    moment += p_.rear_axle_m * drag_n[1];
  }
  const Pair rim_n = grip(load) * d_.roll_n * both.rolling_sign + drive_n;
  Acceleration acc;
  acc.omega_dot = (both.torque_n_m - r * rim_n) / d_.side_inertia;
  acc.eta1_dot = (body_n[0] + load[kForceForward]) / m + gravity[0] + eta2 * w + load[kAccForward];
  acc.eta2_dot = (body_n[1] + load[kForceLeft]) / m + gravity[1] - eta1 * w + load[kAccLateral];
  acc.theta_ddot = (moment + load[kTorqueYaw]) / p_.inertia_kg_m2 + load[kAccYaw];
  return acc;
}

// Friction against the motion of the castor's foot over the floor, alike in every direction.
Pair Plant::castor_drag(const PairedState& x, double grip_ratio, double v_s) const {
  const Pair foot_m_s = x[kEta] + Pair{0.0, -p_.rear_axle_m * x[kTurn][1]};
  const double v2 = foot_m_s[0] * foot_m_s[0] + foot_m_s[1] * foot_m_s[1];
  return grip_ratio * d_.castor_n / std::sqrt(v2 + v_s * v_s) * foot_m_s;
}

// On blocks: each side turns its own wheels and rotors, and nothing pushes the body.
Plant::Acceleration Plant::hanging(const Sides& both) const {
  return {0.0, 0.0, 0.0, both.torque_n_m / d_.side_inertia};
}

void Plant::step(double h_s, const Drive& drive, const LoadVector& begin, const LoadVector& middle,
                 const LoadVector& end) {
  advance<false>(h_s, drive, begin, middle, end);
}

template <bool kPlain>
void Plant::advance(double h_s, const Drive& drive, const LoadVector& begin, const LoadVector& middle,
                    const LoadVector& end) {
  rest_.holds = false;
  const PairedState x = paired(x_);
  const Heading at = heading(x_[kTheta]);
  const auto slope = [&](const PairedState& there, const LoadVector& load) {
    return derivative<kPlain>(there, turned(at, there[kTurn][0] - x_[kTheta]), drive, load);
  };
  const PairedState k1 = derivative<kPlain>(x, at, drive, begin);
  const PairedState k2 = slope(moved(x, 0.5 * h_s, k1), middle);
  const PairedState k3 = slope(moved(x, 0.5 * h_s, k2), middle);
  const PairedState k4 = slope(moved(x, h_s, k3), end);
  PairedState next;
  for (int i = 0; i < kPairs; ++i) {
    next[i] = x[i] + h_s / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
  }
  if (kPlain || (!p_.slip && !p_.lifted)) {  // keeps rounding from adding up; the slopes agree already
    next[kEta][1] = -p_.d0_m * next[kTurn][1];
    next[kOmega] = rolling(next[kEta][0], next[kTurn][1]);
  }
  next[kTurn][1] = std::fabs(next[kTurn][1]) < kNothing ? 0.0 : next[kTurn][1];
  for (const int i : {kEta, kCurrent, kOmega}) next[i] = settled(next[i]);
  x_ = listed(next);
}

// Whether a step with both motors off left everything but the charge as it was, to the bit. The charge acts
// through duty times voltage alone, which is nothing then.
bool Plant::is_rest(const StateVector& before) const {
  static_assert(kCharge == kStates - 1, "the charge is compared with nothing");
  if (x_[kOmegaL] != 0.0) return false;
  return std::memcmp(before.data(), x_.data(), kCharge * sizeof(double)) == 0;
}

bool Plant::rests(double h_s, const Drive& drive) const {
  return rest_.holds && rest_.h_s == h_s && std::memcmp(&rest_.drive, &drive, sizeof drive) == 0;
}

void Plant::step(double h_s, const Drive& drive) {
  constexpr LoadVector kNone{};
  if (rests(h_s, drive)) {
    rest_on();
    return;
  }
  const bool off = drive.duty[0] == 0.0 && drive.duty[1] == 0.0;
  const StateVector before = off ? x_ : StateVector{};
  if (!p_.slip && !p_.lifted && drive.jam[0] == 0.0 && drive.jam[1] == 0.0) {
    advance<true>(h_s, drive, kNone, kNone, kNone);
  } else {
    advance<false>(h_s, drive, kNone, kNone, kNone);
  }
  if (!off || !is_rest(before)) return;
  // All four slopes are the same: the current drawn does not change.
  const double k = -d_.per_charge * draw_a(Pair{x_[kCurrentL], x_[kCurrentR]}, drive);
  rest_ = {true, h_s, h_s / 6.0 * (k + 2.0 * (k + k) + k), drive};
}

}  // namespace twin
