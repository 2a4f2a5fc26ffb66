#include "plant.hpp"

#include <cmath>

namespace twin {
namespace {

constexpr double kGravity = 9.81;  // m/s^2

// Sign with a soft middle: 0.71 at v = v_s, 0.995 at 10 v_s.
inline double soft_sign(double v, double v_s) { return v / std::sqrt(v * v + v_s * v_s); }

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
  d.side_inertia = p.motor_per_side * rotor + 2.0 * p.wheel_inertia_kg_m2;  // two wheels a side
  d.emf_v_s = p.motor_emf_constant_v_s_rad * p.motor_gear_ratio;
  d.gear_n_m_a = p.motor_torque_constant_n_m_a * p.motor_gear_ratio;
  d.weight_n = p.mass_kg * kGravity;
  d.roll_n = 0.5 * p.floor_rolling_ratio * d.weight_n;
  d.slide_front_n = p.floor_friction_ratio * d.weight_n * p.rear_axle_m / wheelbase_m;
  d.slide_rear_n = p.floor_friction_ratio * d.weight_n * p.front_axle_m / wheelbase_m;
  const double rim_kg = 2.0 * d.side_inertia * d.per_radius * d.per_radius;
  d.per_mass_rim = 1.0 / (p.mass_kg + rim_kg);
  d.per_inertia_rim = 1.0 / (p.inertia_kg_m2 + p.mass_kg * p.d0_m * p.d0_m +
                             0.25 * p.track_m * p.track_m * rim_kg);
  return d;
}

void Plant::reset(double x_m, double y_m, double theta_rad) {
  x_.fill(0.0);
  x_[kX] = x_m;
  x_[kY] = y_m;
  x_[kTheta] = theta_rad;
  x_[kCharge] = p_.battery_charge_start_ratio;
}

double Plant::battery_v(const Drive& drive, double sag_v) const {
  return battery_v(x_, drive, sag_v);
}

// The bridge draws duty * current from the battery (power in = power out, drop taken at the motor).
double Plant::draw_a(const StateVector& x, const Drive& drive) const {
  return p_.battery_idle_a + p_.motor_per_side * (drive.duty_left * x[kCurrentL] +
                                                  drive.duty_right * x[kCurrentR]);
}

double Plant::battery_v(const StateVector& x, const Drive& drive, double sag_v) const {
  const double open_v = p_.battery_empty_v + (p_.battery_full_v - p_.battery_empty_v) * x[kCharge];
  return open_v - p_.battery_resistance_ohm * draw_a(x, drive) - sag_v;
}

// Motor, bridge and gear of one side (2.11).
Plant::SideForces Plant::side(double current_a, double omega_rad_s, double duty, double jam,
                              double load_n_m, double battery_v) const {
  const double channel_a = p_.motor_per_side * current_a;
  const double drop_v = p_.bridge_drop_v * soft_sign(channel_a, p_.bridge_smoothing_a) +
                        p_.bridge_resistance_ohm * channel_a;
  const double gear_n_m = d_.gear_n_m_a * current_a;
  const double sign = soft_sign(omega_rad_s * p_.wheel_radius_m, p_.floor_smoothing_m_s);
  const double ratio = omega_rad_s * d_.per_stribeck;
  // Gear loss is friction in proportion to load: eta_g k_t N i when driving, as printed, and no
  // gain of energy when the wheel drives the motor, where eta_g would have to divide.
  const double coulomb_n_m =
      p_.motor_coulomb_n_m +
      (p_.motor_stiction_n_m - p_.motor_coulomb_n_m) / (1.0 + ratio * ratio) +
      (1.0 - p_.motor_gear_efficiency_ratio) * std::fabs(gear_n_m);
  const double friction_n_m = sign * coulomb_n_m + p_.motor_viscous_n_m_s_rad * omega_rad_s;
  SideForces out;
  out.current_dot = d_.per_inductance * (duty * battery_v - drop_v - d_.emf_v_s * omega_rad_s -
                                         p_.motor_resistance_ohm * current_a);
  out.torque_n_m = p_.motor_per_side * (gear_n_m - friction_n_m) - jam * omega_rad_s - load_n_m;
  out.rolling_sign = sign;
  return out;
}

StateVector Plant::derivative(const StateVector& x, const Drive& drive,
                              const LoadVector& load) const {
  const double battery = battery_v(x, drive, load[kBatterySag]);
  const SideForces sides[2] = {
      side(x[kCurrentL], x[kOmegaL], drive.duty_left, drive.jam_left, load[kLoadLeft], battery),
      side(x[kCurrentR], x[kOmegaR], drive.duty_right, drive.jam_right, load[kLoadRight], battery)};
  const double c = std::cos(x[kTheta]), s = std::sin(x[kTheta]);
  // Weight along the floor, body frame, small-angle floor (loads on the axles unchanged).
  const double gx = -kGravity * load[kSlopeX], gy = -kGravity * load[kSlopeY];
  const double gravity[2] = {c * gx + s * gy, c * gy - s * gx};

  StateVector dx{};
  dx[kX] = c * x[kEta1] - s * x[kEta2];
  dx[kY] = s * x[kEta1] + c * x[kEta2];
  dx[kTheta] = x[kThetaDot];
  dx[kCurrentL] = sides[0].current_dot;
  dx[kCurrentR] = sides[1].current_dot;
  dx[kWheelL] = x[kOmegaL];
  dx[kWheelR] = x[kOmegaR];
  dx[kCharge] = -d_.per_charge * draw_a(x, drive);
  if (p_.lifted) {
    hanging(sides, dx);
  } else if (p_.slip) {
    slipping(x, sides, load, gravity, dx);
  } else {
    constrained(x, sides, load, gravity, dx);
  }
  return dx;
}

// Rolling wheels and eta2 = -d0 theta_dot: (S'MS) eta_dot = S'(G tau - F - M S_dot eta), written
// for (eta1, theta_dot), with the inertia of wheels and rotors in both.
void Plant::constrained(const StateVector& x, const SideForces* sides, const LoadVector& load,
                        const double* gravity, StateVector& dx) const {
  const double m = p_.mass_kg, half = 0.5 * p_.track_m, d0 = p_.d0_m;
  const double w = x[kThetaDot], eta1 = x[kEta1], eta2 = x[kEta2];
  const double grip = 1.0 + load[kFrictionChange];
  const double force_l =
      sides[0].torque_n_m * d_.per_radius - grip * d_.roll_n * sides[0].rolling_sign;
  const double force_r =
      sides[1].torque_n_m * d_.per_radius - grip * d_.roll_n * sides[1].rolling_sign;

  const double front_n = grip * d_.slide_front_n *
                         soft_sign(eta2 + p_.front_axle_m * w, p_.floor_smoothing_m_s);
  const double rear_n = grip * d_.slide_rear_n *
                        soft_sign(eta2 - p_.rear_axle_m * w, p_.floor_smoothing_m_s);
  const double lateral_n = front_n + rear_n;                                          // F_y
  const double scrub_n_m = p_.front_axle_m * front_n - p_.rear_axle_m * rear_n;       // in M_r

  const double push_x = load[kForceForward] + m * gravity[0];
  const double push_y = load[kForceLeft] + m * gravity[1];
  dx[kEta1] =
      (force_l + force_r + push_x + m * eta2 * w) * d_.per_mass_rim + load[kAccForward];
  const double moment = half * (force_r - force_l) - scrub_n_m + load[kTorqueYaw] +
                        d0 * (lateral_n - push_y + m * eta1 * w);
  dx[kThetaDot] = moment * d_.per_inertia_rim + load[kAccYaw] - load[kAccLateral] / d0;
  dx[kEta2] = -d0 * dx[kThetaDot];
  dx[kOmegaL] = (dx[kEta1] - half * dx[kThetaDot]) * d_.per_radius;
  dx[kOmegaR] = (dx[kEta1] + half * dx[kThetaDot]) * d_.per_radius;
}

// Four Coulomb contacts: each pushes against the slip velocity of its patch, so that sliding
// sideways takes grip from driving and the other way round.
void Plant::slipping(const StateVector& x, const SideForces* sides, const LoadVector& load,
                     const double* gravity, StateVector& dx) const {
  const double m = p_.mass_kg, r = p_.wheel_radius_m, half = 0.5 * p_.track_m;
  const double w = x[kThetaDot];
  const double grip = 1.0 + load[kFrictionChange];
  const double v_s = p_.floor_slip_smoothing_m_s;
  const double axle_x[2] = {p_.front_axle_m, -p_.rear_axle_m};
  const double wheel_n[2] = {0.5 * grip * d_.slide_front_n, 0.5 * grip * d_.slide_rear_n};
  double fx = 0.0, fy = 0.0, moment = 0.0;
  for (int side = 0; side < 2; ++side) {
    const double y = side == 0 ? half : -half;
    const double slip_x = x[kEta1] - y * w - r * x[kOmegaL + side];
    double drive_n = 0.0;
    for (int axle = 0; axle < 2; ++axle) {
      const double slip_y = x[kEta2] + axle_x[axle] * w;
      const double share =
          wheel_n[axle] / std::sqrt(slip_x * slip_x + slip_y * slip_y + v_s * v_s);
      drive_n -= share * slip_x;
      fy -= share * slip_y;
      moment -= axle_x[axle] * share * slip_y;
    }
    fx += drive_n;
    moment -= y * drive_n;
    const double rim_n = grip * d_.roll_n * sides[side].rolling_sign + drive_n;
    dx[kOmegaL + side] = (sides[side].torque_n_m - r * rim_n) / d_.side_inertia;
  }
  dx[kEta1] = (fx + load[kForceForward]) / m + gravity[0] + x[kEta2] * w + load[kAccForward];
  dx[kEta2] = (fy + load[kForceLeft]) / m + gravity[1] - x[kEta1] * w + load[kAccLateral];
  dx[kThetaDot] = (moment + load[kTorqueYaw]) / p_.inertia_kg_m2 + load[kAccYaw];
}

// On blocks: each side turns its own wheels and rotors, and nothing pushes the body.
void Plant::hanging(const SideForces* sides, StateVector& dx) const {
  for (int side = 0; side < 2; ++side) {
    dx[kOmegaL + side] = sides[side].torque_n_m / d_.side_inertia;
  }
}

void Plant::apply_constraint(StateVector& x) const {
  const double half = 0.5 * p_.track_m;
  x[kEta2] = -p_.d0_m * x[kThetaDot];
  x[kOmegaL] = (x[kEta1] - half * x[kThetaDot]) * d_.per_radius;
  x[kOmegaR] = (x[kEta1] + half * x[kThetaDot]) * d_.per_radius;
}

void Plant::step(double h_s, const Drive& drive, const LoadVector& begin,
                 const LoadVector& middle, const LoadVector& end) {
  const auto moved = [this](const StateVector& slope, double h) {
    StateVector out;
    for (int i = 0; i < kStates; ++i) out[i] = x_[i] + h * slope[i];
    return out;
  };
  const StateVector k1 = derivative(x_, drive, begin);
  const StateVector k2 = derivative(moved(k1, 0.5 * h_s), drive, middle);
  const StateVector k3 = derivative(moved(k2, 0.5 * h_s), drive, middle);
  const StateVector k4 = derivative(moved(k3, h_s), drive, end);
  for (int i = 0; i < kStates; ++i) {
    x_[i] += h_s / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
  }
  if (!p_.slip && !p_.lifted) apply_constraint(x_);  // keeps rounding from adding up; the slopes agree already
}

}  // namespace twin
