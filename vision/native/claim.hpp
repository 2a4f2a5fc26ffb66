// What a disc claims to know of its centre: noise that its rim shows, and what may pull it to one side.
#pragma once

#include <array>

#include "camera.hpp"
#include "rims.hpp"

namespace vision {

// What the residuals of a fitted disc show, px^2 a ray: `fast` varies nine times and more round the
// rim, `odd` three, five and seven times, `twice` twice.
struct RimNoise {
  double fast, odd, twice;
};

// What the claim of a disc rests on. `covariance_px2` (uu, uv, vv) is that of its centre for a noise of
// 1 px a ray; `ground_px` and `cover_px` are how far other levels would move it.
struct Evidence {
  RimNoise noise;
  std::array<double, 3> covariance_px2;
  Vec2 ground_px, cover_px;
  double radius_px, share, gain, contrast_dn, lean;
};

// `rest` is zero for the rays that are left out; `kept` are in.
RimNoise rim_noise(const Round& rest, int kept);

// The share, 0 to 1, of edges off a fitted disc that varies four times round: a square's is near 1.
double squareness(const Round& off);

// The covariance (uu, uv, vv) of a disc's centre, px^2; both discs are of one picture and share its noise.
std::array<double, 3> claim(const Evidence& own, const Evidence& other);

}  // namespace vision
