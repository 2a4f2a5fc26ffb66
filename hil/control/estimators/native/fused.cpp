#include "fused.hpp"

#include <algorithm>
#include <cmath>

namespace estimator {
namespace {

// Reports are dated to this or better: what a wheel can turn meanwhile is no sign of a restart.
constexpr double kDating_s = 0.02;
// Without reports for longer the board has stopped by itself: predict no further on commands.
constexpr double kHorizon_s = 0.3;
// Gated poses agree with each other when each lies within this of where the two before it, carried on
// steadily, put it (m, m, rad): the robot was moved, or slides.
constexpr Innovation kAgree{0.02, 0.02, 0.1};
// No robot slides faster (m/s, m/s, rad/s): two poses further apart are of two things.
constexpr Innovation kSlide{3.0, 3.0, 12.0};

}  // namespace

Fused::Fused(const Assumptions& assumptions, const Geometry& geometry)
    : assumptions_(assumptions), geometry_(geometry), filter_(assumptions, geometry.d0_m),
      speeds_(assumptions.wheel_lag_s, assumptions.sigma_accel_rad_s2, assumptions.sigma_short_rad_s15,
              geometry.rad_per_count) {}

double Fused::pose_age_s(double t_host_s) const {
  return t_pose_s_ ? t_host_s - *t_pose_s_ : std::numeric_limits<double>::infinity();
}

double Fused::agreement_age_s(double t_host_s) const { return t_host_s - t_agreed_s_; }

void Fused::take_command(double t_effect_s, const Sides& omega_rad_s) {
  commands_.add(t_effect_s, omega_rad_s);
}

void Fused::take_wheels(double t_host_s, std::int32_t counts_left, std::int32_t counts_right) {
  const Report report{t_host_s, counts_left, counts_right};
  if (!last_) {
    last_ = report;
    return;
  }
  const Report last = *last_;
  const double dt_s = report.t_s - last.t_s;
  if (dt_s <= 0.0) return;
  last_ = report;
  const double unit = geometry_.rad_per_count;
  const Sides turned_rad{unit * counts_between(last.counts_left, report.counts_left),
                         unit * counts_between(last.counts_right, report.counts_right)};
  if (std::max(std::fabs(turned_rad[0]), std::fabs(turned_rad[1])) >
      geometry_.omega_max_rad_s * (dt_s + kDating_s)) {
    speeds_.restart();
    return;
  }
  speeds_.step(dt_s, turned_rad, commanded(last.t_s, report.t_s));
  commands_.forget_before(report.t_s);
  extend(last.t_s, report.t_s, geometry_.body(turned_rad));
  if (!path_.empty() && path_.front().begin_s < report.t_s - assumptions_.history_s) {
    advance(path_.front().end_s);
  }
}

// The constant pieces of command between two times.
const std::vector<Piece>& Fused::commanded(double begin_s, double end_s) const {
  commands_.segments(begin_s, end_s, pieces_);
  return pieces_;
}

// Appends the part of an increment that lies after the anchor, and moves the head over it.
void Fused::extend(double begin_s, double end_s, const BodyMotion& by) {
  const double start_s = std::max(begin_s, t_anchor_s_);
  if (start_s >= end_s) return;
  const double part = (end_s - start_s) / (end_s - begin_s);
  const BodyMotion rest{part * by.forward_m, part * by.turn_rad};
  path_.push_back({start_s, end_s, rest.forward_m, rest.turn_rad});
  head_ = moved(head_, rest);
}

// The place after a believed motion, scaled: along the heading half-way through the turn.
FlatPose Fused::moved(const FlatPose& at, const BodyMotion& by) const {
  const Vector& x = filter_.mean();
  const double step = x[kDistance] * by.forward_m, d_theta = x[kTurn] * by.turn_rad;
  const double middle = at.theta_rad + 0.5 * d_theta;
  return {at.z1_x_m + step * std::cos(middle), at.z1_y_m + step * std::sin(middle), at.theta_rad + d_theta};
}

FlatPose Fused::anchor() const {
  const Vector& x = filter_.mean();
  return {x[kZ1X], x[kZ1Y], x[kTheta]};
}

// Time up to which motion is known, from a report or a pose.
double Fused::t_head() const { return std::max(last_ ? last_->t_s : kNever_s, t_anchor_s_); }

// Wheel angles turned since the head and wheel speeds at t_s, by the lag model.
WheelSpeeds::Ahead Fused::ahead(double t_s) const {
  const double begin_s = t_head();
  return speeds_.ahead(commanded(begin_s, std::min(t_s, begin_s + kHorizon_s)));
}

// Moves the anchor to t_s over the increments, one by one as the head goes (a turn before a straight is
// another way than after it); the last one is cut there.
void Fused::advance(double t_s) {
  if (t_anchor_s_ > kNever_s && t_s > t_head()) {
    const BodyMotion beyond = geometry_.body(ahead(t_s).angle_rad);
    extend(t_head(), t_s, beyond);
  }
  while (!path_.empty() && path_.front().begin_s < t_s) {
    Increment& first = path_.front();
    Increment step = first;
    if (first.end_s > t_s) {
      const double part = (t_s - first.begin_s) / (first.end_s - first.begin_s);
      const double rest = 1.0 - part;
      step = {first.begin_s, t_s, first.forward_m * part, first.turn_rad * part};
      first = {t_s, first.end_s, first.forward_m * rest, first.turn_rad * rest};
    } else {
      path_.pop_front();
    }
    move_anchor(step.end_s, {step.forward_m, step.turn_rad});
  }
  move_anchor(t_s, {0.0, 0.0});  // where no report tells of motion, time alone passes
}

void Fused::move_anchor(double t_s, const BodyMotion& by) {
  if (t_pose_s_ && t_s > t_anchor_s_) {
    filter_.move(t_s - t_anchor_s_, by.forward_m, by.turn_rad, std::fabs(by.forward_m),
                 std::fabs(by.turn_rad));
  }
  t_anchor_s_ = std::max(t_s, t_anchor_s_);
}

bool Fused::take_pose(double t_exposure_s, const Pose& pose, double sigma_xy_m, double sigma_theta_rad) {
  if (!(t_exposure_s > t_anchor_s_)) return false;  // a time that is no number too
  if (!std::isfinite(pose.x_m + pose.y_m + pose.theta_rad + sigma_xy_m + sigma_theta_rad)) {
    ++gated_total_;
    return false;
  }
  advance(t_exposure_s);
  bool believed = true;
  if (t_pose_s_) {
    believed = correct(t_exposure_s, pose, sigma_xy_m, sigma_theta_rad);
  } else {
    place(t_exposure_s, pose, sigma_xy_m, sigma_theta_rad);
    t_agreed_s_ = t_exposure_s;  // nothing to disagree with yet
  }
  head_ = anchor();
  for (const Increment& i : path_) head_ = moved(head_, {i.forward_m, i.turn_rad});
  return believed;
}

// Sets the anchor on a pose.
void Fused::place(double t_s, const Pose& pose, double sigma_xy_m, double sigma_theta_rad) {
  filter_.place(pose, sigma_xy_m, sigma_theta_rad, excess_);
  t_pose_s_ = t_s;
}

// Corrects the anchor by a pose; a run of gated poses that agree moves it there instead.
bool Fused::correct(double t_s, const Pose& pose, double sigma_xy_m, double sigma_theta_rad) {
  const BodyMotion speed = geometry_.body(speeds_.omega_rad_s());
  const Innovation innovation = filter_.innovation(pose);
  // An exposure dated wrongly by sigma_time looks like an error along the motion.
  const double sigma_time_s = assumptions_.sigma_time_s;
  const double var_xy = square(sigma_xy_m) + square(sigma_time_s * speed.forward_m);
  const double var_theta = square(sigma_theta_rad) + square(sigma_time_s * speed.turn_rad);
  if (filter_.correct(innovation, var_xy, var_theta, assumptions_.gate_chi2, excess_)) {
    t_pose_s_ = t_agreed_s_ = t_s;
    gated_.run = 0;
    return true;
  }
  ++gated_total_;
  refused_ = innovation;
  note_gated(t_s, innovation);
  if (gated_.run < assumptions_.reacquire_poses) return false;
  place(t_s, pose, sigma_xy_m, sigma_theta_rad);
  gated_.innovation = {0.0, 0.0, 0.0};  // the run goes on from the pose believed
  return true;
}

// Counts a gated pose into the run of gated ones that it carries on, or starts a new run with it.
void Fused::note_gated(double t_s, const Innovation& innovation) {
  const double dt_s = t_s - gated_.t_s;
  bool agree = gated_.run > 0;
  Innovation rate{};
  for (int i = 0; i < 3; ++i) {
    const double step = innovation[i] - gated_.innovation[i];
    rate[i] = step / dt_s;
    const double steady = gated_.run > 1 ? gated_.rate[i] * dt_s : 0.0;
    const double limit = gated_.run > 1 ? kAgree[i] : kAgree[i] + kSlide[i] * dt_s;
    agree = agree && std::fabs(step - steady) < limit;
  }
  gated_ = {agree ? gated_.run + 1 : 1, t_s, innovation, agree ? rate : Innovation{}};
}

// The place at a time before the head, not before the anchor.
FlatPose Fused::back_at(double t_s) const {
  FlatPose at = anchor();
  for (const Increment& i : path_) {
    if (i.begin_s >= t_s) break;
    const double part = std::min((t_s - i.begin_s) / (i.end_s - i.begin_s), 1.0);
    at = moved(at, {part * i.forward_m, part * i.turn_rad});
  }
  return at;
}

std::optional<State> Fused::state_at(double t_host_s) const {
  if (!t_pose_s_) return std::nullopt;
  const Vector& x = filter_.mean();
  const WheelSpeeds::Ahead wheels = ahead(t_host_s);
  const FlatPose at =
      t_host_s < t_head() ? back_at(t_host_s) : moved(head_, geometry_.body(wheels.angle_rad));
  const BodyMotion speed = geometry_.body(wheels.omega_rad_s);
  const double eta1 = x[kDistance] * speed.forward_m, w = x[kTurn] * speed.turn_rad;
  const double c = std::cos(at.theta_rad), s = std::sin(at.theta_rad);
  const Pose pose{at.z1_x_m - x[kOffset] * c, at.z1_y_m - x[kOffset] * s, at.theta_rad};
  return State{pose, eta1, w, {at.z1_x_m, at.z1_y_m}, {eta1 * c, eta1 * s}};
}

}  // namespace estimator
