// The robot of docs/twin.md as a differential equation: body, motors, bridge, battery, floor.
// Frames: world X right, Y up; body x forward, y left; theta counter-clockwise. SI units.
// Sides: 0 left, 1 right. Positive duty turns the wheels forward.
#pragma once

#include <array>

#include "direction.hpp"
#include "plant_terms.hpp"
#include "two_lanes.hpp"

namespace twin {

// One list: C++ fields, their Python names, and what a caller must set (no defaults).
// clang-format off
#define TWIN_PLANT_PARAMETERS(X)                                                              \
  X(mass_kg) X(inertia_kg_m2) X(wheel_radius_m) X(track_m) X(front_axle_m) X(rear_axle_m)    \
  X(d0_m) X(wheel_inertia_kg_m2)                                                              \
  X(motor_per_side) X(motor_resistance_ohm) X(motor_inductance_h)                             \
  X(motor_torque_constant_n_m_a) X(motor_emf_constant_v_s_rad) X(motor_gear_ratio)            \
  X(motor_gear_efficiency_ratio) X(motor_rotor_inertia_kg_m2) X(motor_coulomb_n_m)            \
  X(motor_stiction_n_m) X(motor_stribeck_rad_s) X(motor_viscous_n_m_s_rad)                    \
  X(bridge_drop_v) X(bridge_resistance_ohm) X(bridge_smoothing_a)                             \
  X(battery_full_v) X(battery_empty_v) X(battery_capacity_a_h) X(battery_resistance_ohm)      \
  X(battery_charge_start_ratio) X(battery_idle_a)                                             \
  X(floor_rolling_ratio) X(floor_friction_ratio) X(floor_smoothing_m_s)                       \
  X(floor_slip_smoothing_m_s)
// clang-format on

struct PlantParams {
#define X(name) double name = 0.0;
  TWIN_PLANT_PARAMETERS(X)
#undef X
  // Skid steer: two wheels a side, one on each axle. Differential drive: one wheel a side on the
  // front axle, and a castor where the rear axle would be.
  bool castor = false;
  double castor_friction_ratio = 0.0;
  bool slip = false;    // false: operative constraint (2.31) and rolling wheels
  bool lifted = false;  // wheels off the floor: they turn, the body stands
};

// Index of each state in the vector that is integrated.
enum State : int {
  kX,
  kY,
  kTheta,  // m, m, rad: centre of mass in the world
  kEta1,
  kEta2,
  kThetaDot,  // m/s, m/s, rad/s: body frame; eta2 = -d0 theta_dot unless slip
  kCurrentL,
  kCurrentR,  // A, one motor of each side
  kWheelL,
  kWheelR,  // rad, wheel angles
  kOmegaL,
  kOmegaR,  // rad/s, wheel speeds; follow from eta unless slip
  kCharge,  // 0..1
  kStates
};
using StateVector = std::array<double, kStates>;

// What acts on the robot from outside besides the bridge, with the scenario's name for it
// (hil.config.events.Target). Accelerations add to eta1_dot, eta2_dot and theta_ddot; forces and
// the torque act at the centre of mass in the body frame; a wheel load is a torque that pushes backward
// when positive, also at rest; a brake opposes the wheel's motion whichever way (below 0 it is 0);
// slopes raise the floor along world X and Y; the friction change is added to 1 (below 0 it is 0), and
// the sag takes the battery down to 0 V at most.
#define TWIN_LOADS(X)                         \
  X(kAccForward, "eta1_dot_m_s2")             \
  X(kAccLateral, "eta2_dot_m_s2")             \
  X(kAccYaw, "theta_ddot_rad_s2")             \
  X(kForceForward, "force_forward_n")         \
  X(kForceLeft, "force_left_n")               \
  X(kTorqueYaw, "torque_yaw_n_m")             \
  X(kLoadLeft, "load_left_n_m")               \
  X(kLoadRight, "load_right_n_m")             \
  X(kBrakeLeft, "brake_left_n_m")             \
  X(kBrakeRight, "brake_right_n_m")           \
  X(kSlopeX, "slope_x_rad")                   \
  X(kSlopeY, "slope_y_rad")                   \
  X(kFrictionChange, "friction_change_ratio") \
  X(kBatterySag, "battery_sag_v")
enum Load : int {
#define X(id, name) id,
  TWIN_LOADS(X)
#undef X
      kLoads
};
using LoadVector = std::array<double, kLoads>;

struct Drive {             // left, right; held over a step
  Pair duty = {0.0, 0.0};  // -1..1
  Pair jam = {0.0, 0.0};   // N m s/rad, gear jam as a stiff damper
};

// What a step takes into account. A robot that rolls with nothing acting from outside has steps of its own:
// every term that is known to be 0 lengthens the chain of results that wait for each other. kLoads: jams too;
// kAll: robots that slip or are lifted too.
enum class Acts { kNothing, kLoads, kAll };

// A wheel that turns faster has run away.
constexpr double kRunaway_rad_s = 1e4;

class Plant {
 public:
  explicit Plant(const PlantParams& params);

  // Rest at a pose, full start charge, wheel angles zero.
  void reset(double x_m, double y_m, double theta_rad);

  // One RK4 step of h seconds; loads at its begin, middle and end.
  void step(double h_s, const Drive& drive, const LoadVector& begin, const LoadVector& middle,
            const LoadVector& end);

  // The same without loads. A robot that stands stays where it is: only its battery is reckoned then,
  // with the same result to the bit.
  void step(double h_s, const Drive& drive);

  // Whether a step without loads would change nothing but the charge, by what rest_on adds to it.
  bool rests(double h_s, const Drive& drive) const;
  void rest_on() { x_[kCharge] += rest_.charge_change; }

  const StateVector& state() const { return x_; }
  StateVector& changed_state() {  // to be written to
    rest_.holds = false;
    return x_;
  }
  // Whether the wheels roll on the floor without slip, which is what can be reckoned side by side (lanes.hpp).
  bool rolls() const { return !p_.slip && !p_.lifted; }
  bool castor() const { return p_.castor; }
  const Terms<double>& terms() const { return t_; }
  double battery_v(const Drive& drive, double sag_v) const;   // at the terminals, now
  double charge_after(double h_s, const Drive& drive) const;  // at the current drawn now
  StateVector derivative(const StateVector& x, const Drive& drive, const LoadVector& load) const;

 private:
  double draw_a(const Drive& drive) const;  // from the battery, now
  template <Acts kActs>
  void advance(double h_s, const Drive& drive, const LoadVector& begin, const LoadVector& middle,
               const LoadVector& end);

  struct Rest {  // a step that changed nothing but the charge
    bool holds = false;
    double h_s = 0.0, charge_change = 0.0;
    Drive drive;
  };
  bool is_rest(const StateVector& before) const;

  PlantParams p_;
  Terms<double> t_;
  StateVector x_{};
  Rest rest_;
};

}  // namespace twin
