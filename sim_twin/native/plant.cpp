#include "plant.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "plant_model.hpp"

namespace twin {
namespace {

// Slope of a brake's torque through rest, as stiff as a jam of the gears (kernel.cpp).
constexpr double kStiffest_n_m_s_rad = 12.0;
constexpr LoadVector kNoLoads{};
// Below, no speed at which friction falls by half makes a difference, and its square has to be a number.
constexpr double kLeastStribeck_m_s = 1e-9;

// One robot: its left and right side share a register.
struct One : Scalar {
  using Pair = twin::Pair;
  using Flag = bool;
  using Loads = LoadVector;

  TWIN_INLINE static Pair pair(double first, double second) { return Pair{first, second}; }
  TWIN_INLINE static Pair root(Pair v) { return twin::root(v); }
  TWIN_INLINE static double root(double v) { return std::sqrt(v); }
  TWIN_INLINE static Pair inverse(Pair v) { return 1.0 / v; }
  using Scalar::magnitude;
  TWIN_INLINE static Pair magnitude(Pair v) { return twin::magnitude(v); }
  TWIN_INLINE static double not_negative(double v) { return std::max(v, 0.0); }
  TWIN_INLINE static bool any(bool flag) { return flag; }
  template <class V>
  TWIN_INLINE static V choose(bool flag, V yes, V no) {
    return flag ? yes : no;
  }
  TWIN_INLINE static Pair zero_where_below(Pair size, double limit, Pair v) {
    return size < limit ? Pair{0.0, 0.0} : v;
  }
  TWIN_INLINE static double zero_where_below(double size, double limit, double v) {
    return size < limit ? 0.0 : v;
  }
  TWIN_INLINE static Pair brakes(Pair torque_n_m, Pair omega_rad_s, double smooth_rad_s) {
    return Pair{brake_torque(torque_n_m[0], omega_rad_s[0], smooth_rad_s),
                brake_torque(torque_n_m[1], omega_rad_s[1], smooth_rad_s)};
  }
  TWIN_INLINE static void turn_where_far(double by_rad, double d2, double& less, double& s) {
    if (!(d2 < kFarTurn2_rad2)) turn_far(by_rad, less, s);
  }
};

template <Acts kActs>
using OneModel = Model<One, kActs>;
using OneState = PairedState<Pair>;

TWIN_INLINE OneState paired(const StateVector& x) {
  return {{Pair{x[kX], x[kY]}, Pair{x[kTheta], x[kThetaDot]}, Pair{x[kEta1], x[kEta2]},
           Pair{x[kCurrentL], x[kCurrentR]}, Pair{x[kWheelL], x[kWheelR]}, Pair{x[kOmegaL], x[kOmegaR]},
           Pair{x[kCharge], 0.0}}};
}

TWIN_INLINE StateVector listed(const OneState& x) {
  return {x[kPosition][0], x[kPosition][1], x[kTurn][0],    x[kEta][0],   x[kEta][1],
          x[kTurn][1],     x[kCurrent][0],  x[kCurrent][1], x[kWheel][0], x[kWheel][1],
          x[kOmega][0],    x[kOmega][1],    x[kBattery][0]};
}

}  // namespace

void turn_far(double by_rad, double& less, double& s) {
  const Direction<double> by = direction(by_rad);
  less = 1.0 - by.cos;
  s = by.sin;
}

// Against the motion, with the soft middle of all friction here; softer for a strong brake, so that it is never
// stiffer than kStiffest.
double brake_torque(double torque_n_m, double omega_rad_s, double smooth_rad_s) {
  if (!(torque_n_m > 0.0)) return 0.0;
  const double soft_rad_s = std::max(smooth_rad_s, torque_n_m / kStiffest_n_m_s_rad);
  return torque_n_m * omega_rad_s / std::sqrt(omega_rad_s * omega_rad_s + soft_rad_s * soft_rad_s);
}

Plant::Plant(const PlantParams& params) : p_(params), t_(derive(params)) { reset(0.0, 0.0, 0.0); }

Terms<double> derive(const PlantParams& p) {
  const double rotor = p.motor_gear_ratio * p.motor_gear_ratio * p.motor_rotor_inertia_kg_m2;
  const double wheelbase_m = p.front_axle_m + p.rear_axle_m;
  const double weight_n = p.mass_kg * kGravity;
  const double per_radius = 1.0 / p.wheel_radius_m;
  const double at_rim = p.motor_per_side * per_radius;  // N of a side's rims per N m of a motor at the wheel
  const double bridge_smoothing_a = p.bridge_smoothing_a / p.motor_per_side;
  const double stribeck_m_s = std::max(p.motor_stribeck_rad_s * p.wheel_radius_m, kLeastStribeck_m_s);
  Terms<double> t{};
  t.mass_kg = p.mass_kg;
  t.inertia_kg_m2 = p.inertia_kg_m2;
  t.wheel_radius_m = p.wheel_radius_m;
  t.half_track_m = 0.5 * p.track_m;
  t.front_axle_m = p.front_axle_m;
  t.rear_axle_m = p.rear_axle_m;
  t.d0_m = p.d0_m;
  t.front_arm_m = p.front_axle_m - p.d0_m;
  t.rear_arm_m = p.rear_axle_m + p.d0_m;
  t.mass_arm_kg_m = p.mass_kg * p.d0_m;
  t.motor_per_side = p.motor_per_side;
  t.bridge_drop_v = p.bridge_drop_v;
  t.resistance_ohm = p.motor_resistance_ohm + p.motor_per_side * p.bridge_resistance_ohm;
  t.bridge_smoothing2_a2 = bridge_smoothing_a * bridge_smoothing_a;
  t.emf_v_s_m = p.motor_emf_constant_v_s_rad * p.motor_gear_ratio * per_radius;
  t.drive_n_a = p.motor_torque_constant_n_m_a * p.motor_gear_ratio * at_rim;
  t.loss_n_a = (1.0 - p.motor_gear_efficiency_ratio) * t.drive_n_a;
  t.coulomb_n = p.motor_coulomb_n_m * at_rim;
  t.viscous_n_s_m = p.motor_viscous_n_m_s_rad * at_rim * per_radius;
  t.stribeck2_m2_s2 = stribeck_m_s * stribeck_m_s;
  t.stribeck_n_m2_s2 = (p.motor_stiction_n_m - p.motor_coulomb_n_m) * at_rim * t.stribeck2_m2_s2;
  t.battery_empty_v = p.battery_empty_v;
  t.battery_span_v = p.battery_full_v - p.battery_empty_v;
  t.battery_resistance_ohm = p.battery_resistance_ohm;
  t.battery_idle_a = p.battery_idle_a;
  t.floor_smoothing_m_s = p.floor_smoothing_m_s;
  t.floor_slip_smoothing_m_s = p.floor_slip_smoothing_m_s;
  t.floor_smoothing2_m2_s2 = p.floor_smoothing_m_s * p.floor_smoothing_m_s;
  t.per_radius = per_radius;
  t.per_inductance = 1.0 / p.motor_inductance_h;
  t.per_charge = 1.0 / (3600.0 * p.battery_capacity_a_h);
  t.side_inertia_kg_m2 = p.motor_per_side * rotor + (p.castor ? 1.0 : 2.0) * p.wheel_inertia_kg_m2;
  t.roll_n = 0.5 * p.floor_rolling_ratio * weight_n;
  t.slide_front_n = p.floor_friction_ratio * weight_n * p.rear_axle_m / wheelbase_m;
  t.slide_rear_n = p.floor_friction_ratio * weight_n * p.front_axle_m / wheelbase_m;
  if (p.castor) {  // it has the rear axle's load and neither its grip nor its rolling resistance
    const double castor_ratio = p.front_axle_m / wheelbase_m;
    t.roll_n *= 1.0 - castor_ratio;
    t.slide_rear_n = 0.0;
    t.castor_n = p.castor_friction_ratio * weight_n * castor_ratio;
  }
  const double rim_kg = 2.0 * t.side_inertia_kg_m2 * per_radius * per_radius;
  t.per_mass_rim = 1.0 / (p.mass_kg + rim_kg);
  t.per_inertia_rim =
      1.0 / (p.inertia_kg_m2 + p.mass_kg * p.d0_m * p.d0_m + 0.25 * p.track_m * p.track_m * rim_kg);
  return t;
}

void Plant::reset(double x_m, double y_m, double theta_rad) {
  x_.fill(0.0);
  rest_.holds = false;
  x_[kX] = x_m;
  x_[kY] = y_m;
  x_[kTheta] = theta_rad;
  x_[kCharge] = p_.battery_charge_start_ratio;
}

double Plant::draw_a(const Drive& drive) const {
  const Pair current_a = {x_[kCurrentL], x_[kCurrentR]};
  return OneModel<Acts::kNothing>{t_, drive.duty, drive.jam, p_.castor}.draw_a(current_a);
}

double Plant::battery_v(const Drive& drive, double sag_v) const {
  const OneModel<Acts::kNothing> model{t_, drive.duty, drive.jam, p_.castor};
  return model.battery_v(x_[kCharge], draw_a(drive), sag_v);
}

double Plant::charge_after(double h_s, const Drive& drive) const {
  return x_[kCharge] - h_s * t_.per_charge * draw_a(drive);
}

StateVector Plant::derivative(const StateVector& x, const Drive& drive, const LoadVector& load) const {
  const OneModel<Acts::kAll> model{t_, drive.duty, drive.jam, p_.castor, p_.slip, p_.lifted};
  return listed(model.derivative(paired(x), direction(x[kTheta]), load));
}

void Plant::step(double h_s, const Drive& drive, const LoadVector& begin, const LoadVector& middle,
                 const LoadVector& end) {
  advance<Acts::kAll>(h_s, drive, begin, middle, end);
}

template <Acts kActs>
void Plant::advance(double h_s, const Drive& drive, const LoadVector& begin, const LoadVector& middle,
                    const LoadVector& end) {
  rest_.holds = false;
  const OneModel<kActs> model{t_, drive.duty, drive.jam, p_.castor, p_.slip, p_.lifted};
  x_ = listed(model.advanced(paired(x_), {h_s, 0.5 * h_s, h_s / 6.0}, begin, middle, end));
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
  if (rests(h_s, drive)) {
    rest_on();
    return;
  }
  const bool off = drive.duty[0] == 0.0 && drive.duty[1] == 0.0;
  const StateVector before = off ? x_ : StateVector{};
  if (rolls() && drive.jam[0] == 0.0 && drive.jam[1] == 0.0) {
    advance<Acts::kNothing>(h_s, drive, kNoLoads, kNoLoads, kNoLoads);
  } else {
    advance<Acts::kAll>(h_s, drive, kNoLoads, kNoLoads, kNoLoads);
  }
  if (!off || !is_rest(before)) return;
  // All four slopes are the same: the current drawn does not change.
  const double k = -t_.per_charge * draw_a(drive);
  rest_ = {true, h_s, h_s / 6.0 * (k + 2.0 * (k + k) + k), drive};
}

}  // namespace twin
