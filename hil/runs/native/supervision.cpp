#include "supervision.hpp"

#include <cmath>

#include "exact.hpp"

namespace runs {
namespace {

using core::words;

// Poses seen outside the fence, one after the other, that end the run: one may be a wrong find.
constexpr int kOutsidePoses = 2;
// So many poses seen and not believed are no camera that does not see.
constexpr long long kRefusedPoses = 3;
// What the camera may see of a metre or a radian that the wheels turn. A robot file that is off by a
// fifth and tyres that slip in turns stay within 0.5 to 1.6; a wrong sign is -1, a robot held is 0.
constexpr double kLeastScale = 0.2, kMostScale = 3.0;
// Older wheel reports say nothing of what the wheels turn now; 50 come in a second.
constexpr double kFresh_s = 0.1;
// The board stops by itself after so long without a set-point (firmware core, SETPOINT_TIMEOUT).
constexpr double kBoardWaits_s = 0.25;
constexpr char kDisagreeWhy[] = "marks exchanged, picture mirrored, or the robot pushed or held?";

}  // namespace

void Supervisor::check_clock(double now_s) {
  const double back_s = newest_s_ - now_s;
  newest_s_ = now_s;
  if (back_s > 0.0) {
    throw core::RigFault(words("host: its clock went back by %.3f s; nothing can be timed by it", back_s));
  }
}

void Supervisor::check_host(double now_s) {
  const double away_s = now_s - last_tick_s_;
  last_tick_s_ = now_s;
  if (away_s > kBoardWaits_s) {
    throw core::RigFault(
        words("host: %.2f s between two ticks (limit %g s: the board stops by itself then); process "
              "stopped, machine suspended or overloaded, or its clock stepped",
              away_s, kBoardWaits_s));
  }
}

void Supervisor::saw(bool seen, double x_m, double y_m, const std::string& reason, double agreement_age_s) {
  seen_ = seen;
  reason_ = reason;
  if (!seen) return;
  x_m_ = x_m;
  y_m_ = y_m;
  outside_ = inside(x_m, y_m) ? 0 : outside_ + 1;
  refused_ = agreement_age_s <= 0.0 ? 0 : refused_ + 1;
}

void Supervisor::check(double now_s, double report_s, const Agreement& agreement) const {
  const double silent_s = now_s - report_s;
  if (silent_s > safety_.link_lost_s) {
    throw core::RigFault(
        words("link: no wheel report for %.2f s (limit %g s)", silent_s, safety_.link_lost_s));
  }
  if (outside_ >= kOutsidePoses && seen_) left("robot seen at", x_m_, y_m_);
  check_agreement(agreement);
  if (silent_s <= kFresh_s) check_scales(agreement);  // without reports wheels are only thought to turn
}

void Supervisor::check_estimate(double x_m, double y_m) const {
  if (!inside(x_m, y_m)) left("robot at", x_m, y_m);
}

// Throws when no pose was believed for too long, or none was seen.
void Supervisor::check_agreement(const Agreement& agreement) const {
  if (agreement.age_s <= safety_.pose_lost_s) return;
  const std::string duration = words("for %.2f s (limit %g s)", agreement.age_s, safety_.pose_lost_s);
  if (refused_ >= kRefusedPoses) {
    const auto [x_m, y_m, turn_rad] = agreement.refused;
    throw Disagreement(
        words("camera and wheels disagree: robot not seen where the wheels take it %s: %lld poses "
              "refused, the last one %.3f m and %.0f deg off; %s",
              duration.c_str(), refused_, core::hypot(x_m, y_m), turn_rad * (180.0 / 3.14159265358979323846),
              kDisagreeWhy));
  }
  throw core::RigFault("camera: robot not seen " + duration + (reason_.empty() ? "" : ": " + reason_));
}

// Throws when poses are believed only because the wheels no longer count.
void Supervisor::check_scales(const Agreement& agreement) {
  for (int i = 0; i < 2; ++i) {
    const double seen = agreement.scales[i];
    const char* unit = i == 0 ? "m" : "rad";
    if (kLeastScale <= seen && seen <= kMostScale) continue;
    throw Disagreement(
        words("camera and wheels disagree: %.2f %s seen for each %s that the wheels turn (limits %g to "
              "%g %s); %s",
              seen, unit, unit, kLeastScale, kMostScale, unit, kDisagreeWhy));
  }
}

bool Supervisor::inside(double x_m, double y_m) const {
  return safety_.fence_x_min_m <= x_m && x_m <= safety_.fence_x_max_m && safety_.fence_y_min_m <= y_m &&
         y_m <= safety_.fence_y_max_m;
}

void Supervisor::left(const char* how, double x_m, double y_m) const {
  throw core::RigFault(words("geofence: %s (%.3f, %.3f) m, allowed X %g to %g m, Y %g to %g m", how, x_m, y_m,
                             safety_.fence_x_min_m, safety_.fence_x_max_m, safety_.fence_y_min_m,
                             safety_.fence_y_max_m));
}

}  // namespace runs
