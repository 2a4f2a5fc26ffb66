#include "fast.h"

#include "wheel_pid.h"

#include "constants.h"

namespace hil {
namespace wheel_pid {

Tuning tuning(const Params& p) { return {p.pid_kp_duty_s_rad, p.pid_ki_duty_rad, p.pid_kd_duty_s2_rad}; }

float step(State& law, const Tuning& t, const Tracked& w) {
  const float out = -(t.kp * w.error_rad_s + t.ki * law.integral_rad + t.kd * w.error_rate_rad_s2);
  if (may_integrate(w, w.error_rad_s)) law.integral_rad += TICK_S * w.error_rad_s;
  return out;
}

}  // namespace wheel_pid
}  // namespace hil
