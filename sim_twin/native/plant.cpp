#include "plant.hpp"

#include <cmath>

namespace twin {
namespace {

constexpr double kGravity = 9.81;  // m/s^2

// Sign with a soft middle: 0.71 at v = v_s, 0.995 at 10 v_s.
inline double soft_sign(double v, double v_s) { return v / std::sqrt(v * v + v_s * v_s); }

}  // namespace

Plant::Plant(const PlantParams& params) : p_(params) {
  const double n = p_.motor_per_side;
  const double rotor = p_.motor_gear_ratio * p_.motor_gear_ratio * p_.motor_rotor_inertia_kg_m2;
  wheel_side_inertia_ = n * rotor + 2.0 * p_.wheel_inertia_kg_m2;  // two wheels a side
  reset(0.0, 0.0, 0.0);
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
double Plant::battery_v(const StateVector& x, const Drive& drive, double sag_v) const {
  const double open_v =
      p_.battery_empty_v + (p_.battery_full_v - p_.battery_empty_v) * x[kCharge];
  const double draw_a = p_.battery_idle_a + p_.motor_per_side * (drive.duty_left * x[kCurrentL] +
                                                                 drive.duty_right * x[kCurrentR]);
  return open_v - p_.battery_resistance_ohm * draw_a - sag_v;
}

// Motor, bridge and gear of one side (2.11).
Plant::SideForces Plant::side(double current_a, double omega_rad_s, double duty, double jam,
                              double load_n_m, double battery_v) const {
  const double n = p_.motor_per_side;
  const double channel_a = n * current_a;
  const double drop_v = p_.bridge_drop_v * soft_sign(channel_a, p_.bridge_smoothing_a) +
                        p_.bridge_resistance_ohm * channel_a;
  const double emf_v = p_.motor_emf_constant_v_s_rad * p_.motor_gear_ratio * omega_rad_s;
  const double gear_n_m = p_.motor_torque_constant_n_m_a * p_.motor_gear_ratio * current_a;
  const double sign = soft_sign(omega_rad_s * p_.wheel_radius_m, p_.floor_smoothing_m_s);
  const double ratio = omega_rad_s / p_.motor_stribeck_rad_s;
  // Gear loss is friction in proportion to load: eta_g k_t N i when driving, as printed, and no
  // gain of energy when the wheel drives the motor, where eta_g would have to divide.
  const double coulomb_n_m =
      p_.motor_coulomb_n_m +
      (p_.motor_stiction_n_m - p_.motor_coulomb_n_m) / (1.0 + ratio * ratio) +
      (1.0 - p_.motor_gear_efficiency_ratio) * std::fabs(gear_n_m);
  const double friction_n_m = sign * coulomb_n_m + p_.motor_viscous_n_m_s_rad * omega_rad_s;
  SideForces out;
  out.current_dot =
      (duty * battery_v - drop_v - p_.motor_resistance_ohm * current_a - emf_v) /
      p_.motor_inductance_h;
  out.torque_n_m = n * (gear_n_m - friction_n_m) - jam * omega_rad_s - load_n_m;
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
  const double draw_a = p_.battery_idle_a + p_.motor_per_side * (drive.duty_left * x[kCurrentL] +
                                                                 drive.duty_right * x[kCurrentR]);
  dx[kCharge] = -draw_a / (3600.0 * p_.battery_capacity_a_h);
  if (p_.slip) {
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
  const double m = p_.mass_kg, r = p_.wheel_radius_m, half = 0.5 * p_.track_m, d0 = p_.d0_m;
  const double af = p_.front_axle_m, b = p_.rear_axle_m;
  const double w = x[kThetaDot], eta1 = x[kEta1], eta2 = x[kEta2];
  const double grip = 1.0 + load[kFrictionChange];
  const double roll_n = grip * p_.floor_rolling_ratio * 0.5 * m * kGravity;
  const double force_l = sides[0].torque_n_m / r - roll_n * sides[0].rolling_sign;
  const double force_r = sides[1].torque_n_m / r - roll_n * sides[1].rolling_sign;

  const double front = soft_sign(eta2 + af * w, p_.floor_smoothing_m_s);
  const double rear = soft_sign(eta2 - b * w, p_.floor_smoothing_m_s);
  const double slide_n = grip * p_.floor_friction_ratio * m * kGravity / (af + b);
  const double lateral_n = slide_n * (b * front + af * rear);            // F_y
  const double scrub_n_m = slide_n * af * b * (front - rear);            // M_r, lateral part

  const double rim_kg = wheel_side_inertia_ / (r * r);
  const double push_x = load[kForceForward] + m * gravity[0];
  const double push_y = load[kForceLeft] + m * gravity[1];
  dx[kEta1] = (force_l + force_r + push_x + m * eta2 * w) / (m + 2.0 * rim_kg) + load[kAccForward];
  const double moment = half * (force_r - force_l) - scrub_n_m + load[kTorqueYaw] +
                        d0 * (lateral_n - push_y + m * eta1 * w);
  const double inertia = p_.inertia_kg_m2 + m * d0 * d0 + 2.0 * half * half * rim_kg;
  dx[kThetaDot] = moment / inertia + load[kAccYaw] - load[kAccLateral] / d0;
  dx[kEta2] = -d0 * dx[kThetaDot];
  dx[kOmegaL] = (dx[kEta1] - half * dx[kThetaDot]) / r;
  dx[kOmegaR] = (dx[kEta1] + half * dx[kThetaDot]) / r;
}

// Four Coulomb contacts: each pushes against the slip velocity of its patch, so that sliding
// sideways takes grip from driving and the other way round.
void Plant::slipping(const StateVector& x, const SideForces* sides, const LoadVector& load,
                     const double* gravity, StateVector& dx) const {
  const double m = p_.mass_kg, r = p_.wheel_radius_m, half = 0.5 * p_.track_m;
  const double af = p_.front_axle_m, b = p_.rear_axle_m;
  const double w = x[kThetaDot];
  const double grip = 1.0 + load[kFrictionChange];
  const double v_s = p_.floor_slip_smoothing_m_s;
  const double axle_x[2] = {af, -b};
  const double weight_n[2] = {0.5 * m * kGravity * b / (af + b), 0.5 * m * kGravity * af / (af + b)};
  double fx = 0.0, fy = 0.0, moment = 0.0;
  for (int side = 0; side < 2; ++side) {
    const double y = side == 0 ? half : -half;
    const double slip_x = x[kEta1] - y * w - r * x[kOmegaL + side];
    double drive_n = 0.0;
    for (int axle = 0; axle < 2; ++axle) {
      const double slip_y = x[kEta2] + axle_x[axle] * w;
      const double share = grip * p_.floor_friction_ratio * weight_n[axle] /
                           std::sqrt(slip_x * slip_x + slip_y * slip_y + v_s * v_s);
      drive_n -= share * slip_x;
      fy -= share * slip_y;
      moment -= axle_x[axle] * share * slip_y;
    }
    fx += drive_n;
    moment -= y * drive_n;
    const double roll_n = grip * p_.floor_rolling_ratio * 0.5 * m * kGravity;
    dx[kOmegaL + side] = (sides[side].torque_n_m - r * roll_n * sides[side].rolling_sign -
                          r * drive_n) / wheel_side_inertia_;
  }
  dx[kEta1] = (fx + load[kForceForward]) / m + gravity[0] + x[kEta2] * w + load[kAccForward];
  dx[kEta2] = (fy + load[kForceLeft]) / m + gravity[1] - x[kEta1] * w + load[kAccLateral];
  dx[kThetaDot] = (moment + load[kTorqueYaw]) / p_.inertia_kg_m2 + load[kAccYaw];
}

void Plant::apply_constraint(StateVector& x) const {
  const double half = 0.5 * p_.track_m;
  x[kEta2] = -p_.d0_m * x[kThetaDot];
  x[kOmegaL] = (x[kEta1] - half * x[kThetaDot]) / p_.wheel_radius_m;
  x[kOmegaR] = (x[kEta1] + half * x[kThetaDot]) / p_.wheel_radius_m;
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
  if (!p_.slip) apply_constraint(x_);  // keeps rounding from adding up; the slopes agree already
}

}  // namespace twin
