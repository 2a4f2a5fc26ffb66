// The robot of docs/twin.md as a differential equation: body, motors, bridge, battery, floor.
// Frames: world X right, Y up; body x forward, y left; theta counter-clockwise. SI units.
// Sides: 0 left, 1 right. Positive duty turns the wheels forward.
#pragma once

#include <array>

#include "two_lanes.hpp"

namespace twin {

// What one step calls four times: a chain of results that wait for each other, which a call's way
// through memory makes a tenth longer.
#define TWIN_INLINE [[gnu::always_inline]] inline

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

// The same states two by two, as the integration works on them.
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
using PairedState = std::array<Pair, kPairs>;

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
  double battery_v(const Drive& drive, double sag_v) const;   // at the terminals, now
  double charge_after(double h_s, const Drive& drive) const;  // at the current drawn now
  StateVector derivative(const StateVector& x, const Drive& drive, const LoadVector& load) const;

 private:
  struct Sides {        // left, right
    Pair current_dot;   // A/s, one motor
    Pair torque_n_m;    // all motors of the side at the wheels, friction and load taken off
    Pair rolling_sign;  // smoothed sign of the rim speed
  };
  struct Acceleration {
    double eta1_dot, eta2_dot, theta_ddot;  // m/s^2, m/s^2, rad/s^2, body frame
    Pair omega_dot;                         // rad/s^2
  };
  // Each with and without what acts from outside (`load`, jams): a rolling robot's steps are mostly without,
  // and every term that is known to be 0 lengthens the chain of results that wait for each other.
  template <bool kPlain>
  TWIN_INLINE Sides sides(Pair current_a, Pair omega_rad_s, const Drive& drive, const LoadVector& load,
                          double battery_v) const;
  // Quotients that do not change, because a division costs as much as ten products.
  struct Derived {
    double per_radius, per_inductance, per_stribeck, per_charge;
    double side_inertia;                   // kg m^2, wheels and reflected rotors of one side
    double emf_v_s, gear_n_m_a;            // V per rad/s and N m per A at the wheel
    double weight_n;                       // m g
    double roll_n;                         // rolling resistance of one side
    double slide_front_n, slide_rear_n;    // sliding friction of the wheels in front, in the rear
    double castor_n;                       // friction of the castor
    double per_mass_rim, per_inertia_rim;  // 1 / (m + rims), 1 / (I + m d0^2 + rims): (S'MS)^-1
  };

  struct Heading {
    double cos, sin;
  };

  static Derived derive(const PlantParams& p);
  static Heading heading(double theta_rad);
  TWIN_INLINE static Heading turned(const Heading& from, double by_rad);
  [[gnu::cold, gnu::noinline]] static Heading turned_far(const Heading& from, double by_rad);
  TWIN_INLINE double battery_v(double charge_ratio, double draw_a, double sag_v) const;
  TWIN_INLINE double draw_a(Pair current_a, const Drive& drive) const;  // from the battery
  TWIN_INLINE double brake(double torque_n_m, double omega_rad_s) const;
  template <bool kPlain>
  void advance(double h_s, const Drive& drive, const LoadVector& begin, const LoadVector& middle,
               const LoadVector& end);
  template <bool kPlain>
  TWIN_INLINE PairedState derivative(const PairedState& x, const Heading& at, const Drive& drive,
                                     const LoadVector& load) const;
  template <bool kPlain>
  TWIN_INLINE Acceleration constrained(const PairedState& x, const Sides& both, const LoadVector& load,
                                       const double* gravity) const;
  Acceleration slipping(const PairedState& x, const Sides& both, const LoadVector& load,
                        const double* gravity) const;
  Acceleration hanging(const Sides& both) const;
  Pair castor_drag(const PairedState& x, double grip_ratio, double v_s) const;
  TWIN_INLINE Pair rolling(double eta1, double w) const;  // wheel speeds, or their rates from the body's

  struct Rest {  // a step that changed nothing but the charge
    bool holds = false;
    double h_s = 0.0, charge_change = 0.0;
    Drive drive;
  };
  bool is_rest(const StateVector& before) const;

  PlantParams p_;
  Derived d_;
  StateVector x_{};
  Rest rest_;
};

}  // namespace twin
