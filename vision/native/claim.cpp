#include "claim.hpp"

#include <algorithm>
#include <cmath>

namespace vision {
namespace {

constexpr double kTurn = 6.283185307179586;
constexpr int kSlowTurns = 8;
// White noise of pixels, measured on 12 radii from 4 to 32 px: how much more of it moves a centre than
// is left in `fast`, and how much more is in `odd`; rays share pixels, the more so on a small disc.
constexpr double kWhiteCentre = 1.18, kWhiteCentrePx = 9.5, kWhiteCentrePower = 3.2;
constexpr double kWhiteOdd = 1.1, kWhiteOddPx = 8.6, kWhiteOddPower = 2.6;
// Of that, the share of the levels inside, whose first turn is grown where light falls to one side.
constexpr double kLean = 3.0;
// Noise beyond that is of patches larger than a pixel (blocks of a JPEG, colour at half resolution,
// smear): the larger they are, the more of it varies just once, which the fit has taken up.
constexpr double kPatches = 2.4;
constexpr double kPatchSlope = 0.16;
// Blur leaves what varies twice, alike on both sides; a share of it is not alike.
constexpr double kTwice = 0.012;
constexpr double kTwiceFree = 0.8;
constexpr double kTwiceFreeFast = 1.3;
// Of a rim of which a share is seen; and with a profile's gain (`Edges::gain`).
constexpr double kSharePower = 0.7;
constexpr double kGainPower = 0.06;
// Error over what other levels would change, squared.
constexpr double kGround = 1.6;
constexpr double kCover = 80.0;
// Rounding, where no noise is seen.
constexpr double kFreePx = 0.002;

using Wave = std::array<std::array<double, kRays>, 2>;  // cosine and sine
const std::array<Wave, kSlowTurns + 1>& waves() {
  static const std::array<Wave, kSlowTurns + 1> kept = [] {
    std::array<Wave, kSlowTurns + 1> all;
    for (int turns = 0; turns <= kSlowTurns; ++turns) {
      for (int ray = 0; ray < kRays; ++ray) {
        all[turns][0][ray] = std::cos(kTurn * ray * turns / kRays);
        all[turns][1][ray] = std::sin(kTurn * ray * turns / kRays);
      }
    }
    return all;
  }();
  return kept;
}

// The square of what varies so many times round.
double power_of(const Round& values, int turns) {
  double along = 0.0;
  double across = 0.0;
  for (int ray = 0; ray < kRays; ++ray) {
    along += values[ray] * waves()[turns][0][ray];
    across += values[ray] * waves()[turns][1][ray];
  }
  return along * along + across * across;
}

// Variance of the noise that moves a centre, px^2 a ray.
double centre_noise(const Evidence& own, const Evidence& other) {
  const double radius = std::max(own.radius_px, 4.0);
  // Noise is the same in the picture's levels: the paler disc has more of it in its edges.
  const double paler = other.contrast_dn / std::max(own.contrast_dn, 1.0);
  const double fast = 0.5 * (own.noise.fast + paler * paler * other.noise.fast);
  const double odd = 0.5 * (own.noise.odd + paler * paler * other.noise.odd);
  const double twice = 0.5 * (own.noise.twice + other.noise.twice);
  const double leant = 1.0 + kLean * own.lean * (2.0 + own.lean);
  const double white = kWhiteCentre * leant + std::pow(kWhiteCentrePx / radius, kWhiteCentrePower);
  const double white_odd = kWhiteOdd + std::pow(kWhiteOddPx / radius, kWhiteOddPower);
  const double patches = std::max(odd - white_odd * fast, 0.0);
  const double larger = std::pow(1.0 + patches / std::max(fast, 1e-12), kPatchSlope);
  const double uneven = std::max(twice - kTwiceFree * odd - kTwiceFreeFast * fast, 0.0);
  const double seen = std::pow(own.share, -kSharePower) * std::pow(own.gain, kGainPower);
  return seen * (white * fast + kPatches * larger * patches) + kTwice * uneven;
}

}  // namespace

RimNoise rim_noise(const Round& rest, int kept) {
  std::array<double, kSlowTurns + 1> power;
  double slow = 0.0;
  double squares = 0.0;
  for (const double r : rest) {
    squares += r * r;
  }
  for (int turns = 0; turns <= kSlowTurns; ++turns) {
    power[turns] = power_of(rest, turns) / kept;
    slow += (turns == 0 ? 1.0 : 2.0) * power[turns];
  }
  const double left = std::max(kRays * squares / kept - slow, 0.0);
  return {left / (kRays - 1 - 2 * kSlowTurns), (power[3] + power[5] + power[7]) / 3.0, power[2]};
}

double squareness(const Round& off) {
  double mean = 0.0;
  for (const double o : off) {
    mean += o / kRays;
  }
  double squares = 0.0;
  for (const double o : off) {
    squares += (o - mean) * (o - mean);
  }
  return 2.0 * power_of(off, 4) / std::max(kRays * squares, 1e-12);
}

std::array<double, 3> claim(const Evidence& own, const Evidence& other) {
  const double variance = centre_noise(own, other);
  const auto [uu, uv, vv] = own.covariance_px2;
  const Vec2 g = own.ground_px;
  const Vec2 c = own.cover_px;
  const double free = kFreePx * kFreePx;
  return {uu * variance + kGround * g.x * g.x + kCover * c.x * c.x + free,
          uv * variance + kGround * g.x * g.y + kCover * c.x * c.y,
          vv * variance + kGround * g.y * g.y + kCover * c.y * c.y + free};
}

}  // namespace vision
