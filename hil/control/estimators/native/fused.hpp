// Camera poses and wheel counts fused at the exposure time, predicted to the actuation time.
// World frame, SI units, radians; all times are host times in s and arguments: nothing here reads a clock.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include "filter.hpp"
#include "odometry.hpp"

namespace estimator {

// The flat output point and the heading.
struct FlatPose {
  double z1_x_m, z1_y_m, theta_rad;
};

// State of the robot at one time: pose of the centre of mass, speeds, flat output (2.35) and its rate.
struct State {
  Pose pose;
  double eta1_m_s, theta_dot_rad_s;
  std::array<double, 2> z1_m, z2_m_s;
};

// The default estimator.
//
// The filter lives at the last exposure ("anchor"). Wheel reports since then are kept: a pose moves the
// anchor forward over them and corrects it there; between poses dead reckoning over them gives the latest
// report ("head"), and the wheel loop's lag model with the commands under way gives the actuation time.
class Fused {
 public:
  Fused(const Assumptions& assumptions, const Geometry& geometry);

  // Takes wheel speeds commanded to be in effect from t_effect_s on.
  void take_command(double t_effect_s, const Sides& omega_rad_s);

  // Takes one wheel report (in time order; a stale one is dropped).
  void take_wheels(double t_host_s, std::int32_t counts_left, std::int32_t counts_right);

  // What is known of the covariance of the poses to come, besides their two sigmas.
  void expect(const Excess& excess) { excess_ = excess; }

  // Takes the pose seen at t_exposure_s in the past; older than the last one is dropped. Says whether it was
  // believed: it passed the gate, or ended a run of gated ones that agree.
  bool take_pose(double t_exposure_s, const Pose& pose, double sigma_xy_m, double sigma_theta_rad);

  // The state at t_host_s, past the last exposure; nothing before the first pose. Speeds are predicted; for
  // a time already passed they are those of the latest report.
  std::optional<State> state_at(double t_host_s) const;

  // Time since the last exposure that was believed, by the gate or by a run of gated poses that agree; inf
  // before the first.
  double pose_age_s(double t_host_s) const;

  // Time since the last exposure whose pose agreed with the wheels (passed the gate); inf before the first.
  double agreement_age_s(double t_host_s) const;

  // The last pose refused minus the pose expected then; zero before the first.
  const Innovation& refused() const { return refused_; }

  // The filter at the last exposure.
  const PoseFilter& filter() const { return filter_; }

  // Poses refused since the start.
  std::int64_t gated_total() const { return gated_total_; }

 private:
  static constexpr double kNever_s = -std::numeric_limits<double>::infinity();

  struct Report {
    double t_s;
    std::int32_t counts_left, counts_right;
  };
  struct Increment {  // odometry between two instants, in believed units
    double begin_s, end_s, forward_m, turn_rad;
  };
  struct GatedRun {  // gated poses in a row that agree with each other; the last one and its rate of change
    int run = 0;
    double t_s = kNever_s;
    Innovation innovation{}, rate{};
  };

  double t_head() const;
  WheelSpeeds::Ahead ahead(double t_s) const;
  FlatPose anchor() const;
  FlatPose moved(const FlatPose& at, const BodyMotion& by) const;
  FlatPose back_at(double t_s) const;
  const std::vector<Piece>& commanded(double begin_s, double end_s) const;
  void extend(double begin_s, double end_s, const BodyMotion& by);
  void advance(double t_s);
  void move_anchor(double t_s, const BodyMotion& by);
  void place(double t_s, const Pose& pose, double sigma_xy_m, double sigma_theta_rad);
  bool correct(double t_s, const Pose& pose, double sigma_xy_m, double sigma_theta_rad);
  void note_gated(double t_s, const Innovation& innovation);

  Assumptions assumptions_;
  Geometry geometry_;
  Excess excess_{};
  PoseFilter filter_;
  WheelSpeeds speeds_;
  CommandHistory commands_;
  std::optional<Report> last_;
  std::deque<Increment> path_;  // after the anchor
  double t_anchor_s_ = kNever_s;
  FlatPose head_{0.0, 0.0, 0.0};
  std::optional<double> t_pose_s_;
  double t_agreed_s_ = kNever_s;
  GatedRun gated_;
  Innovation refused_{};
  std::int64_t gated_total_ = 0;
  mutable std::vector<Piece> pieces_;  // answer of `commanded`; kept so that asking does not allocate
};

}  // namespace estimator
