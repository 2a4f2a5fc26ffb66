// Wheel side of the default estimator: believed geometry, counters, commands under way, wheel speeds.
// Body frame x forward, y left; theta_dot > 0 means the right wheel is faster. SI units, radians. The path
// is kept for the flat output point z1 = X + d0 e, which moves exactly along the heading e (control.md
// section 1). Sides: 0 left, 1 right.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <vector>

namespace estimator {

using Sides = std::array<double, 2>;  // left, right

struct BodyMotion {
  double forward_m, turn_rad;  // or per s
};

// The robot as the host believes it to be (hil.control.estimators.BelievedGeometry).
struct Geometry {
  double wheel_radius_m, track_width_m, d0_m, rad_per_count;
  double omega_max_rad_s;  // no wheel turns faster: a larger step of its counter is a restarted board

  // Motion of the body from wheel angles in rad, or its speeds from wheel speeds in rad/s.
  BodyMotion body(const Sides& wheels) const {
    return {0.5 * wheel_radius_m * (wheels[0] + wheels[1]),
            wheel_radius_m * (wheels[1] - wheels[0]) / track_width_m};
  }
};

// fresh - old of a signed 32-bit counter that may have wrapped in between.
std::int32_t counts_between(std::int32_t old, std::int32_t fresh);

// A piece of constant command.
struct Piece {
  double duration_s;
  Sides omega_rad_s;
};

// Wheel speeds commanded, each from its time of effect on; at rest before the first.
class CommandHistory {
 public:
  // Adds a command; one that takes effect before an earlier one replaces it.
  void add(double t_s, const Sides& omega_rad_s);

  // Drops what was superseded before t_s.
  void forget_before(double t_s);

  // Puts the constant pieces between two times into `pieces`, in order.
  void segments(double t0_s, double t1_s, std::vector<Piece>& pieces) const;

 private:
  struct Command {
    double t_s;
    Sides omega_rad_s;
  };
  std::deque<Command> commands_{{-std::numeric_limits<double>::infinity(), {0.0, 0.0}}};
};

// Both wheel speeds by a Kalman filter on the counts, with the wheel loop's lag as the model.
//
// Per wheel the state is [angle, speed, shortfall]: speed_dot = (command - shortfall - speed)/lag + noise.
// The shortfall is what the wheel loop leaves standing (friction, a blocked wheel), a random walk; without
// it a wheel that does not obey would be taken to turn. The wheels share one covariance because they share
// times and noise. Quantisation enters as count^2/12.
class WheelSpeeds {
 public:
  struct Ahead {
    Sides angle_rad;    // turned under the commands
    Sides omega_rad_s;  // at their end
  };

  WheelSpeeds(double lag_s, double sigma_accel_rad_s2, double sigma_short_rad_s15, double unit_rad);

  // Forgets what was learned: at the start, and when the counters have jumped.
  void restart();

  // Prediction from the latest report on, under the commands `pieces`.
  Ahead ahead(const std::vector<Piece>& pieces) const;

  // Takes the angles turned in dt_s under the commands `pieces`.
  void step(double dt_s, const Sides& turned_rad, const std::vector<Piece>& pieces);

  // Speeds at the latest report.
  const Sides& omega_rad_s() const { return omega_; }

 private:
  struct Covariance {  // upper triangle
    double p00, p01, p02, p11, p12, p22;
  };

  double lag_;                    // s
  double q_speed_, q_short_, r_;  // rad^2/s^4, rad^2/s^3, rad^2
  Sides offset_, omega_, short_;  // offset: filtered angle minus counted angle
  Covariance p_;
};

}  // namespace estimator
