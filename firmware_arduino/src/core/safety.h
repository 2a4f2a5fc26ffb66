// The supervisor: what is wrong, what follows from it, and why. It latches: SAFE is left by arming only.
#ifndef HIL_CORE_SAFETY_H
#define HIL_CORE_SAFETY_H

#include <stdint.h>

#include "constants.h"
#include "params.h"
#include "wire.h"

namespace hil {

// Conditions are bits: bit n for HIL_REASON n, above them what the host asks for.
using Conditions = uint16_t;
constexpr Conditions condition(uint8_t reason) { return static_cast<Conditions>(1u << reason); }
constexpr Conditions WANTS_ARM = condition(HIL_REASON_ENUM_END);
constexpr Conditions WANTS_DISARM = condition(HIL_REASON_ENUM_END + 1);
constexpr Conditions ANY_FAULT = static_cast<Conditions>(WANTS_ARM - 1u) & ~condition(HIL_REASON_NONE);

// The whole of the state machine: first row that fits wins, no row: the state stays.
struct SafetyRule {
  uint8_t state;
  Conditions any_of;
  uint8_t next;
};
uint8_t safety_next(uint8_t state, Conditions conditions);
// The fault of highest rank among the conditions, HIL_REASON_NONE when there is none.
uint8_t safety_reason(Conditions conditions);

// Limits in ticks and counts, worked out off the tick.
struct SafetyLimits {
  uint32_t setpoint_age_us;  // beyond this the time-out would pass before the next tick
  uint16_t battery_low_mv, battery_good_mv, battery_ticks;
  uint16_t stall_ticks, runaway_ticks, overspeed_ticks;
  uint16_t pause_ticks;  // from here on a wheel that stood while it was driven is remembered
  int16_t stall_pwm, stall_creeping_pwm, runaway_pwm;
  float stall_setpoint_rad_s;
  float runaway_error_rad_s;
  float overspeed_rad_s;
  uint16_t illegal_per_s;
  bool edges_too_fast;  // at OVER_W more counts a tick than the encoder's tally holds
};
SafetyLimits safety_limits(const Params& params);

// One side as the checks see it: set-point and PWM in force since the last tick, counts moved under
// them, speed.
struct SideView {
  float setpoint_rad_s;  // 0 unless armed
  int16_t pwm;
  int16_t moved_counts;
  float omega_rad_s;
};

// How long something has held, and what is remembered of earlier times: that fades at an eighth of the rate,
// so that a loose contact adds up.
struct Tally {
  uint16_t ticks;
  uint16_t remembered;
  uint8_t fade;
};

struct SafetyView {
  SideView side[SIDES];
  uint16_t illegal_total;
  uint16_t battery_mv;
  uint32_t setpoint_age_us;
};

struct Safety {
  uint8_t state;
  uint8_t reason;
  // Since the wheel last got on, that is by two counts: one live channel of a broken encoder flickers by one
  // and never gets further.
  int16_t net_counts[SIDES];
  Tally stall[SIDES];
  Tally runaway[SIDES];
  uint16_t overspeed_ticks[SIDES];
  uint16_t battery_ticks;
  bool battery_low;
  uint16_t illegal_at_window;
  uint8_t window_ticks;
  bool encoder_fault;
  Conditions standing;  // faults that also bar arming
};

void safety_init(Safety& s, uint16_t illegal_total);
// Brings the checks up to date and returns the faults that hold now.
Conditions safety_check(Safety& s, const SafetyLimits& limits, const SafetyView& view);
// Applies the table; returns true when the state changed.
bool safety_apply(Safety& s, Conditions conditions);

}  // namespace hil

#endif
