#include "kernel.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace twin {
namespace {

// Pin levels (A << 1) | B in the order forward motion meets them: A leads B.
constexpr std::uint8_t kGray[4] = {0b00, 0b10, 0b11, 0b01};
// A jam is a damper stiff enough to hold a stalled motor's torque below 0.1 rad/s.
constexpr double kJam_n_m_s_rad = 12.0;

// The whole number at or below x, without the call that floor is on older processors.
inline std::int64_t floored(double x) {
  const auto whole = static_cast<std::int64_t>(x);
  return static_cast<double>(whole) > x ? whole - 1 : whole;
}

}  // namespace

Encoder::Encoder(int counts_per_turn) : counts_per_rad_(counts_per_turn / (2.0 * 3.14159265358979323846)) {}

void Encoder::reset(double angle_rad) {
  angle_rad_ = angle_rad;
  count_ = floored(position(angle_rad));
  pins_ = kGray[count_ & 3];
}

// A dead channel stays at the level its pin has now; swapped wires exchange the pins; a disturbance of
// the wires inverts both.
std::uint8_t Encoder::level(const FaultState::Side& fault) const {
  std::uint8_t ab = kGray[count_ & 3];
  if (fault.swapped) ab = static_cast<std::uint8_t>(((ab & 1) << 1) | (ab >> 1));
  if (fault.dead_a) ab = static_cast<std::uint8_t>((ab & 0b01) | (pins_ & 0b10));
  if (fault.dead_b) ab = static_cast<std::uint8_t>((ab & 0b10) | (pins_ & 0b01));
  if (fault.glitch) ab ^= 0b11;
  return ab;
}

void Encoder::move(double angle_rad, double t0_us, double h_us, const FaultState::Side& fault, int side,
                   std::vector<PinEdge>& edges) {
  const double begin = position(angle_rad_), end = position(angle_rad);
  const std::int64_t last = floored(end);
  const double us_per_count = last != count_ && end != begin ? h_us / (end - begin) : 0.0;
  angle_rad_ = angle_rad;
  do {  // once without a crossing too: wires may have changed
    const bool forward = last > count_;
    const double boundary = static_cast<double>(forward ? count_ + 1 : count_);
    const double t_us = last == count_ ? t0_us : t0_us + us_per_count * (boundary - begin);
    if (last != count_) count_ += forward ? 1 : -1;
    const std::uint8_t ab = level(fault);
    if (ab != pins_) edges.push_back({t_us, side, ab});
    pins_ = ab;
  } while (count_ != last);
}

std::int64_t Encoder::turn(double angle_rad) {
  angle_rad_ = angle_rad;
  const std::int64_t before = count_;
  count_ = floored(position(angle_rad));
  pins_ = kGray[count_ & 3];
  return count_ - before;
}

bool Encoder::in_order() const { return pins_ == kGray[count_ & 3]; }

Kernel::Kernel(const PlantParams& params, const KernelOptions& options, std::shared_ptr<BoardSide> board)
    : plant_(params), options_(options), board_(std::move(board)),
      encoders_{Encoder(options.counts_per_turn), Encoder(options.counts_per_turn)} {
  if (options.step_us <= 0 || kPoseSpacing_us % options.step_us != 0) {
    throw std::invalid_argument("step_us must divide 1000 us");
  }
  reset(0.0, 0.0, 0.0);
}

void Kernel::reset(double x_m, double y_m, double theta_rad) {
  plant_.reset(x_m, y_m, theta_rad);
  for (Encoder& encoder : encoders_) encoder.reset(0.0);
  slipped_rad_ = {};
  time_us_ = 0;
  begin_us_ = kNever_us;
  outside_from_us_ = outside_until_us_ = 0;
  pose_count_ = 0;
  drive_ = {};
  battery_v_ = plant_.battery_v(drive_, 0.0);
  board_held_ = false;
  board_->sent.clear();
  const std::uint8_t pins[2] = {encoders_[0].pins(), encoders_[1].pins()};
  board_->set_reset(false, 0, pins);
  remember({x_m, y_m, theta_rad});
}

void Kernel::remember(const PoseSample& pose) {
  poses_[static_cast<std::size_t>(pose_count_) % kPoses] = pose;
  ++pose_count_;
}

std::int64_t Kernel::advance(std::int64_t t_us) {
  while (goes_on(t_us)) {
    coast(t_us);
    if (time_us_ < t_us) step();
  }
  return time_us_;
}

// Takes at once the steps of a robot that stands while its board has nothing to do: of all that a step
// does only the clock, the charge and the remembered poses would change.
void Kernel::coast(std::int64_t t_us) {
  if (outside_ || !faults_.empty() || disturbed()) return;
  std::int64_t until_us = std::min(t_us, board_->quiet_until_us());
  if (!disturbances_.empty()) until_us = std::min(until_us, begin_us_);
  if (until_us <= time_us_ + options_.step_us) return;
  set_drive();
  const StateVector& x = plant_.state();
  if (!plant_.rests(1e-6 * static_cast<double>(options_.step_us), drive_)) return;
  if (!encoders_[0].stands_at(x[kWheelL]) || !encoders_[1].stands_at(x[kWheelR])) return;
  while (time_us_ + options_.step_us < until_us) {
    plant_.rest_on();
    time_us_ += options_.step_us;
    if (time_us_ % kPoseSpacing_us == 0) remember({x[kX], x[kY], x[kTheta]});
  }
  sag_v_ = 0.0;
  battery_v_ = plant_.battery_v(drive_, sag_v_);
}

std::vector<Chunk> Kernel::take_sent() {
  std::vector<Chunk> out;
  out.swap(board_->sent);
  return out;
}

void Kernel::follow_reset_line() {
  if (fault_.board_in_reset == board_held_) return;
  board_held_ = fault_.board_in_reset;
  const std::uint8_t pins[2] = {encoders_[0].pins(), encoders_[1].pins()};
  board_->set_reset(board_held_, time_us_, pins);
}

void Kernel::set_drive() {
  for (int side = 0; side < 2; ++side) {
    const int channel = fault_.motors_exchanged ? 1 - side : side;
    drive_.duty[side] =
        board_->duty(channel) * (fault_.side[side].reversed ? -1.0 : 1.0) * fault_.side[side].strength;
    drive_.jam[side] = fault_.side[side].stuck ? kJam_n_m_s_rad : 0.0;
  }
}

void Kernel::set_outside(OutsidePlant outside, std::int64_t period_us) {
  if (period_us < options_.step_us || period_us % options_.step_us != 0) {
    throw std::invalid_argument("the period must be a multiple of step_us");
  }
  outside_ = std::move(outside);
  outside_period_us_ = period_us;
}

LoadVector Kernel::loads_now() const {
  if (!disturbed()) return LoadVector{};
  const StateVector& x = plant_.state();
  return disturbances_.loads(1e-6 * static_cast<double>(time_us_ - begin_us_), x[kX], x[kY]);
}

void Kernel::follow_outside(double h_s) {
  if (time_us_ >= outside_until_us_) {
    const LoadVector loads = loads_now();
    outside_from_ = plant_.state();
    sag_v_ = loads[kBatterySag];
    outside_to_ = outside_(time_us_, drive_.duty * battery_v_, loads, drive_.jam);
    outside_from_us_ = time_us_;
    outside_until_us_ = time_us_ + outside_period_us_;
  }
  const double charge = plant_.charge_after(h_s, drive_);
  const auto done_us = static_cast<double>(time_us_ + options_.step_us - outside_from_us_);
  const double share = done_us / static_cast<double>(outside_period_us_);
  StateVector& x = plant_.changed_state();
  for (int i = 0; i < kStates; ++i) {
    x[i] = share < 1.0 ? outside_from_[i] + share * (outside_to_[i] - outside_from_[i]) : outside_to_[i];
  }
  x[kCharge] = charge;
}

void Kernel::integrate() {
  const double h_s = 1e-6 * static_cast<double>(options_.step_us);
  if (outside_) {
    follow_outside(h_s);
    return;
  }
  sag_v_ = 0.0;
  if (!disturbed()) {
    plant_.step(h_s, drive_);
    return;
  }
  const StepLoads loads = step_loads(time_us_, plant_.state()[kX], plant_.state()[kY]);
  plant_.step(h_s, drive_, loads[0], loads[1], loads[2]);
  sag_v_ = loads[2][kBatterySag];
}

// Zones are looked up at the pose where the step begins: 0.1 mm at most.
Kernel::StepLoads Kernel::step_loads(std::int64_t t_us, double x_m, double y_m) const {
  const double h_s = 1e-6 * static_cast<double>(options_.step_us);
  const double t_s = 1e-6 * static_cast<double>(t_us - begin_us_);
  return {disturbances_.loads(t_s, x_m, y_m), disturbances_.loads(t_s + 0.5 * h_s, x_m, y_m),
          disturbances_.loads(t_s + h_s, x_m, y_m)};
}

void Kernel::set_faults() {
  if (faults_.empty()) return;
  const std::int64_t since_us = std::max<std::int64_t>(time_us_ - begin_us_, 0);
  fault_ = faults_.at(1e-6 * static_cast<double>(since_us));
  follow_reset_line();
}

void Kernel::step() {
  set_faults();
  set_drive();
  const StateVector& x = plant_.state();
  const double wheel_rad[2] = {x[kWheelL], x[kWheelR]};
  integrate();
  end_step(wheel_rad);
}

// All of a step but the robot's motion; wheel_rad: the wheels at its begin.
void Kernel::end_step(const double wheel_rad[2]) {
  const auto t0_us = static_cast<double>(time_us_);
  const auto h_us = static_cast<double>(options_.step_us);
  const StateVector& x = plant_.state();
  // Before the encoders, which would count every turn of a wheel that has run away; NaN fails too.
  if (!(std::fabs(x[kOmegaL]) + std::fabs(x[kOmegaR]) < kRunaway_rad_s)) {
    throw std::runtime_error("the simulated robot's state diverges");
  }
  edges_.clear();
  for (int side = 0; side < 2; ++side) {
    // Nothing comes of a wheel that has not turned while no wire changes.
    if (faults_.empty() && encoders_[side].stands_at(x[kWheelL + side])) continue;
    const int port = fault_.encoders_exchanged ? 1 - side : side;
    // The encoder sits on the motor, which turns on where the gear slips.
    const double moved_rad = x[kWheelL + side] - wheel_rad[side];
    slipped_rad_[side] += moved_rad * (1.0 / fault_.side[side].grip - 1.0);
    encoders_[side].move(x[kWheelL + side] + slipped_rad_[side], t0_us, h_us, fault_.side[side], port,
                         edges_);
  }
  if (edges_.size() > 1) {
    std::stable_sort(edges_.begin(), edges_.end(),
                     [](const PinEdge& a, const PinEdge& b) { return a.t_us < b.t_us; });
  }
  for (const PinEdge& edge : edges_) board_->edge(edge);
  time_us_ += options_.step_us;
  battery_v_ = plant_.battery_v(drive_, sag_v_);
  board_->advance_to(time_us_, battery_v_);
  if (time_us_ % kPoseSpacing_us == 0) remember({x[kX], x[kY], x[kTheta]});
}

PoseSample Kernel::pose_at(double t_us) const {
  const double now_us = static_cast<double>(time_us_);
  const double newest_us = static_cast<double>((pose_count_ - 1) * kPoseSpacing_us);
  const double oldest_us = newest_us - static_cast<double>((kPoses - 1) * kPoseSpacing_us);
  if (t_us > now_us || t_us < 0.0 || t_us < oldest_us) {
    throw std::out_of_range("pose asked for outside the time that is remembered");
  }
  const StateVector& x = plant_.state();
  const PoseSample now{x[kX], x[kY], x[kTheta]};
  const auto index = static_cast<std::int64_t>(t_us / static_cast<double>(kPoseSpacing_us));
  const double from_us = static_cast<double>(index * kPoseSpacing_us);
  const PoseSample& a = poses_[static_cast<std::size_t>(index) % kPoses];
  const bool open = index + 1 >= pose_count_;  // the piece up to now is still being driven
  if (open && now_us <= from_us) return a;
  const PoseSample& b = open ? now : poses_[static_cast<std::size_t>(index + 1) % kPoses];
  const double u = (t_us - from_us) / (open ? now_us - from_us : double{kPoseSpacing_us});
  return {a.x_m + u * (b.x_m - a.x_m), a.y_m + u * (b.y_m - a.y_m),
          a.theta_rad + u * (b.theta_rad - a.theta_rad)};
}

}  // namespace twin
