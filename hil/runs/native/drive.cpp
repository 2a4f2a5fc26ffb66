#include "drive.hpp"

namespace runs {
namespace {

// A tick that begins later than this share of its period is a missed deadline.
constexpr double kLate = 0.5;

std::array<double, 2> listed(const outer::Vec2& v) { return {std::get<0>(v), std::get<1>(v)}; }
outer::Vec2 paired(const std::array<double, 2>& v) { return {v[0], v[1]}; }

}  // namespace

Drive::Stop Drive::run(bool busy, bool refused, const BoardLimits& board) {
  for (int since = 0; since < kPause; ++since) {
    const Pump::Stop stop = under_way_ ? pump_.go_on(busy) : pump_.begin(due_s(), busy);
    under_way_ = stop != Pump::kReached;
    if (under_way_) return stop == Pump::kHeard ? kHeard : kTaken;
    reached_s_ = pump_.now_s();
    if (!tick(refused, board)) return kAsked;
    if (++tick_ == plan_.ticks) return kDone;
  }
  return kPaused;
}

bool Drive::tick(bool refused, const BoardLimits& board) {
  const double now_s = pump_.rig_now_s();
  if (refused || pump_.link().state != HIL_STATE_ARMED) return false;
  watch_.supervisor.check_host(now_s);
  watch_.check(now_s, pump_.agreement(now_s), board.top_counts);
  const outer::Estimate estimate = look(now_s, board);
  const outer::ReferenceState reference = reference_.at(estimate.t_host_s - plan_.t0_s);
  if (tick_ == 0) law_.reset(reference, estimate);
  act(now_s, reference, law_.step(reference, estimate, plan_.period_s));
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

void Drive::act(double now_s, const outer::ReferenceState& reference, const outer::OuterCommand& command) {
  const double t_s = now_s - plan_.t0_s;
  const bool late = now_s - due_s() > kLate * plan_.period_s;
  const auto [left, right] = geometry_.wheels(command.eta1_m_s, command.theta_dot_rad_s);
  const Command asked{command.eta1_m_s, command.theta_dot_rad_s, left, right};
  const auto goal = listed(reference_.at(t_s).z1_m), aim = listed(reference.z1_m);
  pump_.act(now_s, plan_.period_s, asked, aim[0], aim[1]);
  const auto estimate = pump_.estimate(now_s);
  const Motion truth = pump_.truth();
  watch_.row(
      now_s, t_s, estimate ? &*estimate : nullptr, &truth, goal[0], goal[1], asked, pump_.link(), late,
      [this](double value) { rows.push_back(value); }, [&](auto) { put_terms(common_, command.trace); });
  put_terms(own_, command.trace);
}

void Drive::put_terms(const Keys& keys, const outer::Trace& trace) {
  for (const int key : keys) rows.push_back(key < 0 ? kNone : trace.get(static_cast<std::size_t>(key)));
}

}  // namespace runs
