// Timed disturbances and faults of the simulated robot and board.
#pragma once

#include <cstdint>
#include <vector>

#include "plant.hpp"

namespace twin {

#define TWIN_SHAPES(X) X(kSine, "sine") X(kStep, "step") X(kPulse, "pulse") X(kNoise, "noise")
enum class Shape : int {
#define X(id, name) id,
  TWIN_SHAPES(X)
#undef X
};

// Adds shape(t) * amplitude to one load from start_s to end_s, inside the zone when it has one.
struct Disturbance {
  int load = 0;
  Shape shape = Shape::kStep;
  double amplitude = 0.0;
  double start_s = 0.0, end_s = 0.0;
  double frequency_hz = 0.0, phase_rad = 0.0;  // sine; for noise the top of its band
  std::uint64_t seed = 0;
  double zone_x_m = 0.0, zone_y_m = 0.0, zone_radius_m = 0.0;  // radius 0: everywhere
};

double disturbance_value(const Disturbance& d, double t_s, double x_m, double y_m);

class Disturbances {
 public:
  void add(const Disturbance& disturbance) { items_.push_back(disturbance); }
  bool empty() const { return items_.empty(); }
  LoadVector loads(double t_s, double x_m, double y_m) const;
  // Until when they are what they are at t_s: all nothing, or one of them going on.
  double steady_until_s(double t_s) const;
  bool at_work(double t_s) const;  // whether any goes on

 private:
  std::vector<Disturbance> items_;
};

// Faults of encoder, motors and board, with the scenario's name (hil.config.events.FaultKind).
#define TWIN_FAULTS(X)                        \
  X(kDeadEncoder, "dead_encoder")             \
  X(kDeadChannelA, "dead_channel_a")          \
  X(kDeadChannelB, "dead_channel_b")          \
  X(kSwappedPhases, "swapped_phases")         \
  X(kEncoderNoise, "encoder_noise")           \
  X(kGearSlip, "gear_slip")                   \
  X(kMotorReversed, "motor_reversed")         \
  X(kMotorStuck, "motor_stuck")               \
  X(kMotorWeak, "motor_weak")                 \
  X(kMotorsExchanged, "motors_exchanged")     \
  X(kEncodersExchanged, "encoders_exchanged") \
  X(kBoardReset, "board_reset")
enum class FaultKind : int {
#define X(id, name) id,
  TWIN_FAULTS(X)
#undef X
};

struct Fault {
  FaultKind kind = FaultKind::kDeadEncoder;
  bool left = true, right = true;
  double start_s = 0.0, end_s = 0.0;
  double strength = 1.0;  // weak motor: share of the voltage; slipping gear: share of the turn
};

// What is wrong at one instant.
struct FaultState {
  struct Side {
    bool dead_a = false, dead_b = false, swapped = false, reversed = false, stuck = false;
    bool glitch = false;  // a disturbance of both channels' wires: their levels read inverted
    double strength = 1.0;
    double grip = 1.0;  // share of the motor's turn that reaches the wheel
  };
  Side side[2];
  bool board_in_reset = false;
  bool motors_exchanged = false, encoders_exchanged = false;  // left with right
};

class Faults {
 public:
  void add(const Fault& fault) { items_.push_back(fault); }
  bool empty() const { return items_.empty(); }
  FaultState at(double t_s) const;
  // Until when `at` gives what it gives at t_s; t_s itself where it changes all the time.
  double steady_until_s(double t_s) const;

 private:
  std::vector<Fault> items_;
};

}  // namespace twin
