#include "rims.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "middle.hpp"

namespace vision {
namespace {

constexpr int kGainRays = 9;  // over which gain and noise are
// In radii: how far from the rim an edge is looked for, how far its two levels are away, and over how
// much they are taken. The longer, the more noise gets in; blur at 0.5 m/s over 20 ms is 0.17 each way.
struct Ratios {
  double edge, ends, level;
};
constexpr std::array<Ratios, kLengths> kReaches = {
    {{0.18, 0.18, 0.3}, {0.35, 0.35, 0.2}, {0.52, 0.52, 0.15}, {0.18, 0.52, 0.15}}};
constexpr double kReachMinPx = 1.6;
// A ray counts when its step is this share of the disc's typical one, and its edge in the profile.
constexpr double kStepShare = 0.3;
constexpr double kShiftShare = 0.8;
constexpr double kResponseMinDn = 6.0;
constexpr double kGainMin = 0.02;
constexpr double kBlurredMore = 1.15;
// Ground within so many deviations of that round most of the disc is the same ground and noise; what is
// beyond may be another thing. Noise of a ray is that between rays so far apart that they share no pixels.
constexpr double kUsualSpreads = 3.0;
constexpr int kStepRays = 3;
constexpr double kOwnMinDn = 0.3;
// A disc's level inside may fall by so much with light and shade before it is taken for covered.
constexpr double kDarkFree = 0.1;
constexpr double kLeanMax = 0.1;
constexpr double kLeanNoise = 0.33;  // of a ray's own variance: twice that of a first turn

// Means over neighbouring rays, an odd number of them, of two rounds at a time: each sum waits for the one before.
std::array<Round, 2> about(const Round& one, const Round& other, int rays) {
  const int side = rays / 2;
  std::array<Two, kRays + 2 * kGainRays> values;  // the first and last ones at both ends
  for (int i = -side; i <= kRays + side; ++i) {
    const int ray = (i + kRays) % kRays;
    values[i + side] = Two{one[ray], other[ray]};
  }
  Two sum = {0.0, 0.0};
  for (int i = 0; i < rays; ++i) {
    sum += values[i];
  }
  std::array<Round, 2> means;
  for (int i = 0; i < kRays; ++i) {
    const Two mean = sum / static_cast<double>(rays);
    means[0][i] = mean[0];
    means[1][i] = mean[1];
    sum += values[i + rays] - values[i];
  }
  return means;
}

// Cosine and sine of a ray's angle.
const std::array<Round, 2>& turn() {
  static const std::array<Round, 2> kept = [] {
    std::array<Round, 2> both;
    for (int ray = 0; ray < kRays; ++ray) {
      both[0][ray] = std::cos(6.283185307179586 * ray / kRays);
      both[1][ray] = std::sin(6.283185307179586 * ray / kRays);
    }
    return both;
  }();
  return kept;
}

// Level, gain and shift of the profiles of one length.
struct Length {
  Round rise, level, gain, shift, inner, low, high, strange;
  double usual_low, usual_high, lean;
};

// Running sums of the profile of each ray, kRays x (samples + 1).
std::vector<double> running(const std::vector<float>& response, int samples) {
  std::vector<double> sums(kRays * (samples + 1));
  for (int ray = 0; ray < kRays; ++ray) {
    double* s = &sums[ray * (samples + 1)];
    const float* r = &response[ray * samples];
    s[0] = 0.0;
    for (int i = 0; i < samples; ++i) {
      s[i + 1] = s[i] + r[i];
    }
  }
  return sums;
}

// Noise of what each ray has of its own, from rays so far apart that they share no pixels.
double ray_noise_dn(const Round& values) {
  Round step;
  for (int ray = 0; ray < kRays; ++ray) {
    step[ray] = std::abs(values[ray] - values[(ray + kStepRays) % kRays]);
  }
  return 1.4826 / std::sqrt(2.0) * middle(step);
}

// Levels with their first turn round the disc grown by a share `lean`: light that falls to one side does
// so on from where the levels are taken out to the rim. One that differs by much is a shade or a cover.
// So does one within the noise of the rays' own levels, `inner`, which would only be added to the rest.
Round leaning(const Round& inner, const Round& levels, double lean, double& grown) {
  grown = 0.0;
  if (lean == 0.0) {
    return levels;
  }
  double mean = 0.0;
  double along = 0.0;
  double across = 0.0;
  for (int ray = 0; ray < kRays; ++ray) {
    mean += levels[ray] / kRays;
    along += levels[ray] * turn()[0][ray] * (2.0 / kRays);
    across += levels[ray] * turn()[1][ray] * (2.0 / kRays);
  }
  const double square = along * along + across * across;
  const double own_dn = ray_noise_dn(inner);
  const double sure = 1.0 - kLeanNoise * own_dn * own_dn / std::max(square, 1e-12);
  if (sure <= 0.0 || square > kLeanMax * kLeanMax * mean * mean) {
    return levels;
  }
  grown = sure * lean;
  Round leant;
  for (int ray = 0; ray < kRays; ++ray) {
    leant[ray] = levels[ray] + grown * (along * turn()[0][ray] + across * turn()[1][ray]);
  }
  return leant;
}

// Levels outside, less what their spread round the disc lets them be off that round most of it.
Round settled(const Round& levels) {
  const double usual = middle(levels);
  Round away;
  for (int ray = 0; ray < kRays; ++ray) {
    away[ray] = std::abs(levels[ray] - usual);
  }
  const double free = kUsualSpreads * 1.4826 * middle(away);
  for (int ray = 0; ray < kRays; ++ray) {
    away[ray] = usual + std::copysign(std::max(away[ray] - free, 0.0), levels[ray] - usual);
  }
  return away;
}

struct Swing {
  Round rise, swing, inner, outer, low, high;
  double lean;
};

// Where a profile's mean and its two levels are taken, samples: the mean within `edge` of its middle,
// the levels from `ends` on.
struct Reach {
  int edge, ends, level;
  double lean;
};

// How far between its two levels the mean of each profile is: -1 all outside, 1 all inside.
// With `usual` the level outside is that round most of the disc.
Swing swing(const std::vector<float>& response, const std::vector<double>& sums, int samples, int middle,
            const Reach& reach, bool usual) {
  const auto [edge, ends, level, lean] = reach;
  Round inner, outer, between;
  for (int ray = 0; ray < kRays; ++ray) {
    const double* s = &sums[ray * (samples + 1)];
    const float* r = &response[ray * samples];
    const int first = middle - edge;
    const int last = middle + edge;
    const int in = middle - ends;
    const int out = middle + ends;
    inner[ray] = (s[in] - s[in - level]) / level;
    outer[ray] = (s[out + 1 + level] - s[out + 1]) / level;
    between[ray] = (s[last + 1] - s[first] - 0.5 * (r[first] + r[last])) * (0.5 / edge);
  }
  const auto [levels, grounds] = about(inner, outer, kLevelRays);
  const Round low = settled(grounds);
  Swing found;
  const Round high = leaning(inner, levels, lean, found.lean);
  found.inner = inner;
  found.outer = outer;
  found.low = low;
  found.high = high;
  const double usual_dn = usual ? vision::middle(low) : 0.0;
  for (int ray = 0; ray < kRays; ++ray) {
    const double ground = usual ? usual_dn : low[ray];
    found.rise[ray] = high[ray] - ground;
    found.swing[ray] = 2.0 * (between[ray] - ground) / std::max(found.rise[ray], 1.0) - 1.0;
  }
  return found;
}

// Take level and gain from across the disc where that rises more: blur is the same on both sides,
// what covers one side is no blur.
void take_better_side(Round& level, Round& gain) {
  for (int ray = 0; ray < kRays / 2; ++ray) {
    const int across = ray + kRays / 2;
    const int from = level[ray] >= level[across] ? ray : across;
    level[ray] = level[across] = level[from];
    gain[ray] = gain[across] = gain[from];
  }
}

// How far the ground outside each ray is from that round most of the disc, in units of the noise of one
// sample; `level` samples of a ray make its own ground, `outer`.
Round strangeness(const Round& outer, const Round& low, double usual, int level) {
  const double sample_dn = std::max(ray_noise_dn(outer), kOwnMinDn) * std::sqrt(static_cast<double>(level));
  Round away;
  for (int ray = 0; ray < kRays; ++ray) {
    away[ray] = std::abs(low[ray] - usual) / sample_dn;
  }
  return away;
}

}  // namespace

double reach_px(double radius_px) {
  const double reach = std::max(kReaches[kLengths - 1].ends * radius_px, kReachMinPx);
  return std::min(reach, 0.8 * radius_px);
}

Profiles::Profiles(double radius_px) : half_(0) {
  for (int k = 0; k < kLengths; ++k) {
    const auto [reach, ends, level] = kReaches[k];
    edge_[k] = static_cast<int>(std::ceil(std::max(reach * radius_px, kReachMinPx)));
    ends_[k] = static_cast<int>(std::ceil(std::max(ends * radius_px, kReachMinPx)));
    level_[k] = std::max(2, static_cast<int>(std::nearbyint(level * radius_px)));
    half_ = std::max(half_, ends_[k] + level_[k] + 1);
    // Longer ones are for blurred rims, whose levels fall to one side with the blur and not with light.
    const double levels_at = radius_px - edge_[k] - 0.5 * level_[k];
    lean_[k] = k == 0 && levels_at > 0.5 * radius_px ? (radius_px - 0.5 * edge_[k]) / levels_at - 1.0 : 0.0;
  }
}

Edges Profiles::edges(const std::vector<float>& response) const {
  const int n = samples();
  const std::vector<double> sums = running(response, n);
  std::array<Length, kLengths> lengths;
  for (int k = 0; k < kLengths; ++k) {
    Length& own = lengths[k];
    const int e = edge_[k];
    const Reach reach = {e, ends_[k], level_[k], lean_[k]};
    const bool usual = k == kLengths - 1;
    const Swing here = swing(response, sums, n, half_, reach, usual);
    const Swing in = swing(response, sums, n, half_ - 1, reach, usual);
    const Swing out = swing(response, sums, n, half_ + 1, reach, usual);
    own.rise = here.rise;
    own.inner = here.inner;
    own.low = here.low;
    own.high = here.high;
    own.lean = here.lean;
    own.usual_low = middle(own.low);
    own.usual_high = middle(own.high);
    own.strange = strangeness(here.outer, own.low, own.usual_low, level_[k]);
    Round slope;
    for (int ray = 0; ray < kRays; ++ray) {
      slope[ray] = (in.swing[ray] - out.swing[ray]) * (0.5 * e);
      own.shift[ray] = here.swing[ray] * e;
    }
    const auto [gain, level] = about(slope, own.rise, kGainRays);
    own.gain = gain;
    own.level = level;
    for (double& level : own.level) {
      level = std::max(level, 1.0);
    }
    take_better_side(own.level, own.gain);
  }
  Edges found;
  found.lean = 0.0;
  Round step, inner;
  std::array<int, kRays> best;
  for (int ray = 0; ray < kRays; ++ray) {
    double most = -1.0;
    for (int k = 0; k < kLengths; ++k) {
      const double gain = std::clamp(lengths[k].gain[ray], kGainMin, 1.0);
      // Levels are shared by neighbouring rays, which does not average them over a whole disc.
      const double scatter = 2.0 * edge_[k] * std::sqrt(0.5 / edge_[k] + 0.5 / level_[k]);
      const double moved = edge_[k] * lengths[k].strange[ray];
      const double noise = std::hypot(scatter, moved) / lengths[k].level[ray];
      // The last is for blurred rims alone: its levels do not follow light that falls to one side.
      const double least = k == kLengths - 1 ? kBlurredMore * most : most;
      if (gain / noise > least) {
        most = gain / noise;
        best[ray] = k;
        found.gain[ray] = gain;
        found.noise[ray] = noise;
      }
    }
    const Length& own = lengths[best[ray]];
    found.lean += own.lean / kRays;
    step[ray] = own.rise[ray];
    inner[ray] = own.inner[ray];
    found.shift[ray] = own.shift[ray];
    const double high = own.usual_high;
    const double dark = std::min((own.high[ray] - high) / std::max(high, 1.0) + kDarkFree, 0.0);
    found.cover[ray] = edge_[best[ray]] * dark;
    found.ground[ray] = edge_[best[ray]] * (own.low[ray] - own.usual_low) / own.level[ray];
  }
  Round ordered = inner;
  std::nth_element(ordered.begin(), ordered.begin() + 3 * kRays / 4, ordered.end());
  found.typical_dn = ordered[3 * kRays / 4];
  const double least = std::max(kStepShare * found.typical_dn, kResponseMinDn);
  for (int ray = 0; ray < kRays; ++ray) {
    const double room = kShiftShare * edge_[best[ray]];
    found.usable[ray] = std::min(step[ray], inner[ray]) > least && std::abs(found.shift[ray]) < room;
  }
  return found;
}

}  // namespace vision
