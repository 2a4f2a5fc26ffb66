#include "beside.hpp"

#include <algorithm>

namespace vision {
namespace {

// Where it is looked, radii from the centre: as far beyond the rim as the robot's own plate reaches, and
// within it clear of what motion and lens smear.
constexpr std::array<double, 3> kBeyond = {1.2, 1.4, 1.6};
constexpr std::array<double, 2> kWithin = {0.25, 0.4};
constexpr double kRing = 0.8;
// A colour goes on where it has so much of the disc's response all along, and is not there with less.
constexpr double kGoesOn = 0.6;
constexpr double kMissing = 0.5;
// Where a lamp's image blinds the sensor there is no colour to be judged.
constexpr float kBlindDn = 250.0F;

// Responses round the disc at one radius, each the mean of a ray and its two neighbours: one alone is noise.
struct Ring {
  Round level;
  Mask seen;
};

Ring ring(const Picture& picture, Vec2 centre_px, const std::array<Vec2, kRays>& arms, const Colour& weights,
          double radius) {
  Ring found;
  Round own;
  for (int ray = 0; ray < kRays; ++ray) {
    const Vec2 at = centre_px + radius * arms[ray];
    const Colour c = picture.between(at);
    own[ray] = response(c, weights);
    found.seen[ray] = picture.holds(at) && std::max({c.b, c.g, c.r}) < kBlindDn;
  }
  for (int ray = 0; ray < kRays; ++ray) {
    found.level[ray] = (own[(ray + kRays - 1) % kRays] + own[ray] + own[(ray + 1) % kRays]) / 3.0;
  }
  return found;
}

}  // namespace

Beside beside(const Picture& picture, Vec2 centre_px, const std::array<Vec2, kRays>& arms,
              const Colour& weights, double typical_dn) {
  Mask goes_on, missing;
  goes_on.fill(true);
  missing.fill(true);
  for (const double radius : kBeyond) {
    const Ring out = ring(picture, centre_px, arms, weights, radius);
    for (int ray = 0; ray < kRays; ++ray) {
      goes_on[ray] = goes_on[ray] && out.seen[ray] && out.level[ray] > kGoesOn * typical_dn;
    }
  }
  for (const double radius : kWithin) {
    const Ring in = ring(picture, centre_px, arms, weights, radius);
    for (int ray = 0; ray < kRays; ++ray) {
      missing[ray] = missing[ray] && in.seen[ray] && in.level[ray] < kMissing * typical_dn;
    }
  }
  const Ring about = ring(picture, centre_px, arms, weights, kRing);
  int beyond = 0;
  int hollow = 0;
  for (int ray = 0; ray < kRays; ++ray) {
    beyond += goes_on[ray] ? 1 : 0;
    hollow += missing[ray] && about.level[ray] > kGoesOn * typical_dn ? 1 : 0;
  }
  return {static_cast<double>(beyond) / kRays, static_cast<double>(hollow) / kRays};
}

}  // namespace vision
