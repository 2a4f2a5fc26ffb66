#include "plausibility.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace runs {
namespace {

using core::words;

constexpr const char* kSides[] = {"left", "right"};

// A side is asked to move from here on, and is stuck below this share of it over so long; the board's
// own limit for a wheel without any count is 0.5 s, so that one speaks first. A robot that wriggles about
// its stuck wheel turns that to and fro, by less than the last share.
constexpr double kAsked_rad_s = 2.0;
constexpr double kStuckRatio = 0.03, kStuckPwmRatio = 0.5, kStuck_s = 0.6, kWriggleRatio = 0.1;
// What has turned at least so much of what was asked, at full PWM, is weak and not stuck.
constexpr double kTurnsRatio = 0.1;
// A wheel that turns as asked (above the first share) cannot stand (below the second) and turn again
// this fast: so many dips within the window.
constexpr double kTurnedRatio = 0.6, kDipRatio = 0.05;
constexpr std::size_t kDips = 2;
constexpr double kDipWindow_s = 4.0, kDipLeast_s = 0.08, kDipMost_s = 0.5;
// At full PWM for longer than the run-up takes, a side that gives less than this share is weak.
constexpr double kFullPwmRatio = 0.98, kRunUp_s = 0.4, kWeak_s = 1.0, kWeakRatio = 0.75;
// The same picture while the wheels turn so far; the last is enough where the camera is doubted anyhow.
constexpr std::int64_t kRepeatedFrames = 5;
constexpr double kRepeatedTurn_rad = 1.0, kRepeatedLeast_rad = 0.3;
// Each side asked for something else, and each giving what the other is asked for.
constexpr double kSwappedAsked_rad_s = 2.0, kSwappedRatio = 0.5, kSwapped_s = 0.4;
// No progress: the error has not come down by this for so long, and is not small.
constexpr double kNoProgress_s = 8.0, kProgress_m = 0.02, kFar_m = 0.15;

}  // namespace

void Plausibility::saw(const std::string& picture, const Counts* counts, double rad_per_count) {
  if (picture.empty() || picture != picture_ || !has_counts_) {
    picture_ = picture;
    repeats_ = 0;
    has_counts_ = counts != nullptr;
    if (has_counts_) counts_ = *counts;
    turned_rad_ = 0.0;
    return;
  }
  ++repeats_;
  if (counts == nullptr || repeats_ < kRepeatedFrames) return;
  std::int64_t most = 0;
  for (int side = 0; side < 2; ++side) {
    most = std::max<std::int64_t>(most, std::llabs(std::int64_t{(*counts)[side]} - counts_[side]));
  }
  turned_rad_ = rad_per_count * static_cast<double>(most);
  if (turned_rad_ >= kRepeatedTurn_rad) react(kFramesRepeated, repeated());
}

std::string Plausibility::narrowed(const std::string& fault) const {
  if (!stops_[kFramesRepeated] || repeats_ < kRepeatedFrames || turned_rad_ < kRepeatedLeast_rad)
    return fault;
  return repeated() + "; " + fault;
}

std::string Plausibility::repeated() const {
  return words(
      "camera: frames repeated: the same picture %lld times while the wheels turned %.2f rad (limits %lld "
      "times, %g rad); camera or its driver hangs",
      static_cast<long long>(repeats_ + 1), turned_rad_, static_cast<long long>(kRepeatedFrames + 1),
      kRepeatedTurn_rad);
}

void Plausibility::check(double now_s, const Sides& given_rad_s, const Sides& pwm_counts,
                         std::int64_t pwm_top_counts) {
  const double dt_s = std::isnan(last_s_) ? 0.0 : now_s - last_s_;
  last_s_ = now_s;
  for (int side = 0; side < 2; ++side) {
    const double full_ratio =
        std::fabs(pwm_counts[side]) / static_cast<double>(std::max<std::int64_t>(pwm_top_counts, 1));
    check_side(now_s, dt_s, side, given_rad_s[side], full_ratio);
  }
  check_swapped(now_s, given_rad_s);
}

void Plausibility::check_progress(double now_s, double error_m) {
  if (error_m < least_m_ - kProgress_m || error_m < kFar_m) {
    least_m_ = error_m;
    least_s_ = now_s;
    return;
  }
  if (std::isnan(least_s_)) least_s_ = now_s;
  const double stalled_s = now_s - least_s_;
  if (stalled_s > kNoProgress_s) {
    react(kNoProgress,
          words("robot: no progress: %.3f m from the goal, and not nearer than %.3f m for %.1f s (limits "
                "%g m, %g s); circling, held, or a weak motor?",
                error_m, least_m_, stalled_s, kFar_m, kNoProgress_s));
  }
}

void Plausibility::finish() {
  for (int index = 0; index < 2; ++index) {
    const Side& side = sides_[index];
    if (side.weak_s < kWeak_s || side.asked_rad <= 0.0) continue;
    const double ratio = std::max(side.given_rad, 0.0) / side.asked_rad;
    if (ratio >= kWeakRatio) continue;
    note_(kDiagnosis,
          words("side weak: %s side gives %.2g of what is asked (full PWM for %.1f s; limits %g, %g s); "
                "motor, lead, or a brake on that side?",
                kSides[index], ratio, side.weak_s, kWeakRatio, kWeak_s));
  }
}

void Plausibility::check_side(double now_s, double dt_s, int index, double given, double pwm_ratio) {
  Side& side = sides_[index];
  const double asked = asked_[index];
  const bool moving = std::fabs(asked) >= kAsked_rad_s;
  const bool low = moving && std::fabs(given) < kWriggleRatio * std::fabs(asked);
  const double stuck_s = side.stuck.after(now_s, low && pwm_ratio >= kStuckPwmRatio);
  if (stuck_s <= 0.0) side.stuck_asked_rad = side.stuck_given_rad = 0.0;
  side.stuck_asked_rad += asked * dt_s;
  side.stuck_given_rad += given * dt_s;
  const bool stands = std::fabs(side.stuck_given_rad) < kStuckRatio * std::fabs(side.stuck_asked_rad);
  const bool weak = side.weak_s > kWeak_s && side.given_rad > kTurnsRatio * side.asked_rad;
  if (stuck_s >= kStuck_s && stands && !weak) {
    react(kMotorStuck,
          words("motor stuck: %s wheels turn %.2f rad/s of %.2f rad/s asked at %.0f%% PWM for %.2f s "
                "(limits %.0f%%, %g s)",
                kSides[index], given, asked, 100.0 * pwm_ratio, stuck_s, 100.0 * kStuckRatio, kStuck_s));
  }
  check_dips(now_s, index, given);
  const double full_s = side.full.after(now_s, moving && pwm_ratio >= kFullPwmRatio);
  if (full_s > kRunUp_s) {
    side.weak_s += dt_s;
    side.asked_rad += std::fabs(asked) * dt_s;
    side.given_rad += std::copysign(given, given * asked) * dt_s;
  }
}

// Counts the times a turning wheel's counts stop and come back while it is asked to turn.
void Plausibility::check_dips(double now_s, int index, double given) {
  Side& side = sides_[index];
  const double asked = asked_[index], began_s = side.dip.since_s;
  if (asked * side.asked_rad_s <= 0.0 || std::fabs(asked) < 2.0 * kAsked_rad_s) {
    side.turned = false;
    side.dip.since_s = kInfinite;
    side.asked_rad_s = asked;
    return;
  }
  side.asked_rad_s = asked;
  if (std::fabs(given) < kDipRatio * std::fabs(asked)) {
    side.dip.after(now_s, side.turned);
    return;
  }
  if (began_s < kInfinite && kDipLeast_s <= now_s - began_s && now_s - began_s <= kDipMost_s) {
    side.dips_s.push_back(now_s);
  }
  side.dip.since_s = kInfinite;
  side.turned = std::fabs(given) > kTurnedRatio * std::fabs(asked) || (side.turned && began_s < kInfinite);
  while (!side.dips_s.empty() && now_s - side.dips_s.front() > kDipWindow_s) side.dips_s.pop_front();
  if (side.dips_s.size() < kDips) return;
  react(kEncoderIntermittent, words("encoder intermittent: %s counts stopped and came back %zu times within "
                                    "%.2f s while %.1f rad/s were asked "
                                    "(limits %zu times, %g s); check its plug",
                                    kSides[index], side.dips_s.size(),
                                    now_s - side.dips_s.front() + kDipMost_s, asked, kDips, kDipWindow_s));
}

void Plausibility::check_swapped(double now_s, const Sides& given) {
  const auto [left, right] = asked_;
  const double own = std::fabs(given[0] - left) + std::fabs(given[1] - right);
  const double others = std::fabs(given[0] - right) + std::fabs(given[1] - left);
  const bool against = std::fabs(right - left) >= kSwappedAsked_rad_s && own >= kSwappedAsked_rad_s &&
                       others < kSwappedRatio * own;
  const double held_s = swapped_.after(now_s, against);
  if (held_s < kSwapped_s) return;
  react(kSidesSwapped,
        words("sides swapped: left gives %.1f rad/s of %.1f asked, right %.1f of %.1f, each what the "
              "other is asked for, for %.2f s (limit %g s); motors or encoders exchanged",
              given[0], left, given[1], right, held_s, kSwapped_s));
}

void Plausibility::react(Reaction what, const std::string& evidence) {
  if (stops_[what]) throw core::RigFault(evidence);
  if (told_[what]) return;
  told_[what] = true;
  note_(kDiagnosis, evidence);
}

}  // namespace runs
