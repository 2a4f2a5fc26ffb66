// What lies beyond the rim of a fitted disc, and in its middle: a mark ends at its rim and is whole inside.
#pragma once

#include <array>

#include "camera.hpp"
#include "picture.hpp"
#include "rims.hpp"

namespace vision {

// `beyond` is the part of the rim that shows no edge because the disc's own colour goes on over it, as along a
// box or tape of that colour and not where something else lies over a mark; `hollow` the part inside which that
// colour is not, though it is at the rim: what lies over a mark and hides its middle hides its rim there too.
struct Beside {
  double beyond = 0.0;
  double hollow = 0.0;
};

// For a disc whose rim lies at `arms` from its centre, `typical_dn` its response.
Beside beside(const Picture& picture, Vec2 centre_px, const std::array<Vec2, kRays>& arms,
              const Colour& weights, double typical_dn);

}  // namespace vision
