// The averaged sub-gradient integral sliding mode with its sign solved at the end of a step, docs/wheel-loop.md.
#ifndef HIL_CORE_WHEEL_ASG_ISM_IMPLICIT_H
#define HIL_CORE_WHEEL_ASG_ISM_IMPLICIT_H

#include "wheel_law.h"

namespace hil {
namespace wheel_asg_ism_implicit {

struct Tuning {
  float mu, sigma, sigma_tick, average_max;
  float start_s;      // 1/mu: makes s(0) = 0
  float g;            // duty per unit of wheel acceleration
  float g_over_step;  // g over the step for which the sign is solved
  float bound_duty;   // k, what the sliding term may give
  float step_rad_s;   // a set-point further off than this starts the law anew
};

struct State {
  float integral;  // E, integral of e
  float average;   // sigma * integral of sgn E
  float eta;       // makes s(0) = 0
  float s;
  float step_base_rad_s;  // set-point at which the law last started
};

Tuning tuning(const Params& params);
inline void forget(State& law) { law.s = 0.0f; }
bool stepped(const State& law, const Tuning& t, float setpoint_rad_s);
// Float operations: 17.
float step(State& law, const Tuning& t, const Tracked& w);
inline float sliding(const State& law) { return law.s; }

}  // namespace wheel_asg_ism_implicit
}  // namespace hil

#endif
