// What a wheel law is given, and what it has to have (docs/wheel-loop.md). In its namespace:
//   struct Tuning                    its parameters, divided and rooted beforehand
//   struct State                     what it keeps of one side; all zero is a law at rest
//   Tuning tuning(const Params&)
//   void forget(State&)              the bridge goes off, or law or gains have changed: no integral is left
//   bool stepped(const State&, const Tuning&, float setpoint_rad_s)   so far that the law starts anew
//   float step(State&, const Tuning&, const Tracked&)   one tick: duty, without feed-forward
//   float sliding(const State&)      the sliding variable for the telemetry; 0 where there is none
#ifndef HIL_CORE_WHEEL_LAW_H
#define HIL_CORE_WHEEL_LAW_H

#include <stdint.h>

#include "params.h"

namespace hil {

// How the law of this tick starts: it goes on, or its integrals begin anew and the output jumps to what
// the law says (ANEW), stays where it is (RETUNED), or keeps its feedback part (STEPPED).
enum class Start : uint8_t { RUNNING, ANEW, RETUNED, STEPPED };

// What follows from the set-point alone; worked out when it changes, which is 30 times a second.
struct Demand {
  float setpoint_rad_s;
  float forward_duty;  // feed-forward
  float turn_duty;     // what of it is for the turn
  bool zero;           // counts as zero
};

// One side's wheels as a law sees them.
struct Tracked {
  float omega_rad_s;  // low-passed estimate
  Demand demand;
  float error_rad_s;        // e = omega - omega*
  float error_lag_rad_s;    // low-passed e
  float error_rate_rad_s2;  // filtered derivative of e
  int8_t saturation;        // +1: held below what is wanted, -1: above, 0: free
  Start start;              // of the next tick
  bool fresh;               // the set-point is new in this tick
};

// The laws fall as their integrals grow, so growth in the direction of `push` would drive the output
// further beyond the limit it is held at.
inline bool may_integrate(const Tracked& w, float push) {
  return w.saturation == 0 || (w.saturation > 0) == (push > 0.0f);
}

}  // namespace hil

#endif
