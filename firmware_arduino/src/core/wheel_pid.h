// The PID benchmark of the wheel loop, docs/wheel-loop.md.
#ifndef HIL_CORE_WHEEL_PID_H
#define HIL_CORE_WHEEL_PID_H

#include "wheel_law.h"

namespace hil {
namespace wheel_pid {

struct Tuning {
  float kp, ki, kd;
};

struct State {
  float integral_rad;  // of e
};

Tuning tuning(const Params& params);
inline void forget(State& law) { law.integral_rad = 0.0f; }
inline bool stepped(const State&, const Tuning&, float) { return false; }
// Float operations: 8.
float step(State& law, const Tuning& t, const Tracked& w);
inline float sliding(const State&) { return 0.0f; }

}  // namespace wheel_pid
}  // namespace hil

#endif
