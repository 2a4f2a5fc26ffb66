#include "drive.hpp"

#include "answered_law.hpp"

namespace runs {
namespace {

// A tick that begins later than this share of its period is a missed deadline.
constexpr double kLate = 0.5;

std::array<double, 2> listed(const outer::Vec2& v) { return {std::get<0>(v), std::get<1>(v)}; }
outer::Vec2 paired(const std::array<double, 2>& v) { return {v[0], v[1]}; }

}  // namespace

Drive::Stop Drive::go(bool busy, bool refused, const BoardLimits& board, bool apart) {
  for (int since = 0; since < kPause; ++since) {
    if (!begun_) {
      const Pump::Stop stop = under_way_ ? pump_.go_on(busy, apart) : pump_.begin(due_s(), busy, apart);
      under_way_ = stop != Pump::kReached;
      if (under_way_) return stop == Pump::kHeard ? kHeard : stop == Pump::kTaken ? kTaken : kAway;
      reached_s_ = pump_.now_s();
      begun_ = begin_tick(refused, board);
      if (!begun_) return kAsked;
    }
    if (!ask()) return kLaw;
    begun_ = false;
    act();
    if (++tick_ == plan_.ticks) return kDone;
  }
  return kPaused;
}

// What a tick does before its law is asked; false where the robot has to be stopped.
bool Drive::begin_tick(bool refused, const BoardLimits& board) {
  now_s_ = pump_.rig_now_s();
  if (refused || pump_.link().state != HIL_STATE_ARMED) return false;
  watch_.supervisor.check_host(now_s_);
  watch_.check(now_s_, pump_.agreement(now_s_), board.top_counts);
  estimate_ = look(now_s_, board);
  wanted_ = reference_.at(estimate_.t_host_s - plan_.t0_s);
  return true;
}

// Asks the law; false where its answer has to be worked out by others first.
bool Drive::ask() {
  try {
    if (!reset_) law_.reset(wanted_, estimate_);
    reset_ = true;
    command_ = law_.step(wanted_, estimate_, plan_.period_s);
  } catch (const outer::AnswerWanted&) {
    return false;
  }
  return true;
}

outer::Estimate Drive::look(double now_s, const BoardLimits& board) {
  const estimator::State& state = pump_.look(now_s, board.most_counts);
  outer::Estimate out;
  out.t_host_s = now_s + watch_.uplink_s;
  out.pose = {state.pose.x_m, state.pose.y_m, state.pose.theta_rad};
  out.eta1_m_s = state.eta1_m_s;
  out.theta_dot_rad_s = state.theta_dot_rad_s;
  out.z1_m = paired(state.z1_m);
  out.z2_m_s = paired(state.z2_m_s);
  out.sides_at_limit = {pump_.sides()[0], pump_.sides()[1]};
  out.driven_hard = watch_.driven_hard(board.stall_counts);
  return out;
}

void Drive::act() {
  const double t_s = now_s_ - plan_.t0_s;
  const bool late = now_s_ - due_s() > kLate * plan_.period_s;
  const auto [left, right] = geometry_.wheels(command_.eta1_m_s, command_.theta_dot_rad_s);
  const Command asked{command_.eta1_m_s, command_.theta_dot_rad_s, left, right};
  const auto goal = listed(reference_.at(t_s).z1_m), aim = listed(wanted_.z1_m);
  pump_.act(now_s_, plan_.period_s, asked, aim[0], aim[1]);
  const auto estimate = pump_.estimate(now_s_);
  const Motion truth = pump_.truth();
  watch_.row(
      now_s_, t_s, estimate ? &*estimate : nullptr, &truth, goal[0], goal[1], asked, pump_.link(), late,
      [this](double value) { rows.push_back(value); }, [&](auto) { put_terms(common_, command_.trace); });
  put_terms(own_, command_.trace);
}

void Drive::put_terms(const Keys& keys, const outer::Trace& trace) {
  for (const int key : keys) rows.push_back(key < 0 ? kNone : trace.get(static_cast<std::size_t>(key)));
}

}  // namespace runs
