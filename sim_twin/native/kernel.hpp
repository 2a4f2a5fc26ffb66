// Robot and board in lockstep on one virtual clock of integer microseconds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "kernel_board.hpp"
#include "kernel_events.hpp"
#include "plant.hpp"

namespace twin {

// Two-channel encoder on one wheel: turns wheel angle into pin edges at their own times.
class Encoder {
 public:
  explicit Encoder(int counts_per_turn);
  void reset(double angle_rad);
  // Appends the edges of a step from t0_us to t0_us + h_us that ends at angle_rad.
  void move(double angle_rad, double t0_us, double h_us, const FaultState::Side& fault, int side,
            std::vector<PinEdge>& edges);
  // The same where nobody asks for the edges and no wire is at fault: returns the counts moved by.
  std::int64_t turn(double angle_rad);
  // Whether the pins are those of its place, as without a fault.
  bool in_order() const;
  // Whether the wheel is where the last move left it.
  bool stands_at(double angle_rad) const { return angle_rad == angle_rad_; }
  std::uint8_t pins() const { return pins_; }
  std::int64_t true_count() const { return count_; }

 private:
  double position(double angle_rad) const { return angle_rad * counts_per_rad_ + 0.5; }
  std::uint8_t level(const FaultState::Side& fault) const;

  double counts_per_rad_;
  double angle_rad_ = 0.0;
  std::int64_t count_ = 0;
  std::uint8_t pins_ = 0;
};

// A robot whose motion somebody else works out: given the time, the motors' voltages, what else acts
// on it, and the damping of a jammed gear, it returns the state one period later (its charge is not
// looked at).
using OutsidePlant = std::function<StateVector(std::int64_t t_us, const Pair& volts, const LoadVector& loads,
                                               const Pair& jam)>;

struct PoseSample {
  double x_m = 0.0, y_m = 0.0, theta_rad = 0.0;
};

// Steps of a kernel that were worked out elsewhere (lanes.hpp): for each step's end the places of the robot
// and its wheels, one row after the other; `lanes` numbers lie between two of one row.
struct Track {
  const double* first = nullptr;
  std::ptrdiff_t row = 0, lanes = 0;
  std::int64_t steps = 0;
  enum Column : int { kXOf, kYOf, kThetaOf, kWheelLeftOf, kWheelRightOf, kColumns };
  double at(std::int64_t step, int column) const { return first[step * row + column * lanes]; }
};

struct KernelOptions {
  std::int64_t step_us = 100;
  int counts_per_turn = 1920;
};

class Kernel {
 public:
  Kernel(const PlantParams& params, const KernelOptions& options, std::shared_ptr<BoardSide> board);

  // Robot at rest at the pose, board powered up, time zero.
  void reset(double x_m, double y_m, double theta_rad);
  void add_disturbance(const Disturbance& d) { disturbances_.add(d); }
  void add_fault(const Fault& f) { faults_.add(f); }
  // Event times count from t_us. Before it there are no disturbances, and the faults of time 0.
  void begin(std::int64_t t_us) { begin_us_ = t_us; }

  // Have the robot's motion from outside, asked for once a period; between, it runs straight on.
  void set_outside(OutsidePlant outside, std::int64_t period_us);

  // Run until t_us is reached, or to the end of the step in which the board has sent something.
  // Returns the time reached. Throws when the state diverges.
  std::int64_t advance(std::int64_t t_us);
  // For those who work steps out elsewhere. `advance` is: while it has to go on (`goes_on`), coast, and where it
  // still has to, take a `step`, or as many as `even_steps` says elsewhere and `follow` them.
  bool goes_on(std::int64_t t_us) const { return time_us_ < t_us && board_->sent.empty(); }
  void coast(std::int64_t t_us);
  void step();
  // How many steps towards t_us are those of a robot that rolls, under one duty; the board is asked after the
  // last one at the earliest. 0: take a `step`.
  std::int64_t even_steps(std::int64_t t_us);
  // Whether disturbances are reckoned with now.
  bool disturbed() const { return !disturbances_.empty() && time_us_ >= begin_us_; }
  // Whether anything acts on the robot from outside in them, or a gear is jammed.
  bool acted_on() const { return acted_on_; }
  using StepLoads = std::array<LoadVector, 3>;  // at a step's begin, middle and end
  // Those of a step that begins at t_us (not before `begin`) and at this place.
  StepLoads step_loads(std::int64_t t_us, double x_m, double y_m) const;
  void follow(const Track& track, const StateVector& end, double sag_v);
  const Plant& plant() const { return plant_; }
  const Drive& drive() const { return drive_; }
  std::int64_t step_us() const { return options_.step_us; }
  void receive(std::int64_t t_us, std::string bytes) { board_->receive(t_us, std::move(bytes)); }
  std::vector<Chunk> take_sent();

  std::int64_t time_us() const { return time_us_; }
  // Pose at a time in the last four seconds, straight lines between samples 1 ms apart.
  PoseSample pose_at(double t_us) const;
  const StateVector& state() const { return plant_.state(); }
  double battery_v() const { return battery_v_; }
  double duty(int side) const { return drive_.duty[side]; }
  std::int64_t true_count(int side) const { return encoders_[side].true_count(); }

 private:
  void set_faults();
  void end_step(const double wheel_rad[2]);
  std::int64_t steps_to(std::int64_t t_us) const;
  std::int64_t steady_steps() const;
  bool edges_are_counts() const;
  void follow_reset_line();
  void set_drive();
  void integrate();
  LoadVector loads_now() const;
  void follow_outside(double h_s);
  void remember(const PoseSample& pose);

  static constexpr std::int64_t kNever_us = std::int64_t{1} << 60;
  static constexpr std::int64_t kPoseSpacing_us = 1000;
  static constexpr std::size_t kPoses = 4096;

  Plant plant_;
  OutsidePlant outside_;
  std::int64_t outside_period_us_ = 0;
  std::int64_t outside_from_us_ = 0, outside_until_us_ = 0;
  StateVector outside_from_{}, outside_to_{};
  KernelOptions options_;
  std::shared_ptr<BoardSide> board_;
  Disturbances disturbances_;
  Faults faults_;
  FaultState fault_;
  Drive drive_;
  std::array<Encoder, 2> encoders_;
  std::array<double, 2> slipped_rad_{};  // what the motors have turned more than their wheels
  std::vector<PinEdge> edges_;
  std::array<PoseSample, kPoses> poses_{};
  std::int64_t pose_count_ = 0;
  std::int64_t time_us_ = 0;
  std::int64_t begin_us_ = kNever_us;
  double sag_v_ = 0.0;
  double battery_v_ = 0.0;
  bool board_held_ = false;
  bool acted_on_ = false;  // in the steps that even_steps has given
};

}  // namespace twin
