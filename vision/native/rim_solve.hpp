// One step of a disc's fit: which rays count, and least squares over them.
#pragma once

#include <array>
#include <optional>

#include "camera.hpp"
#include "rims.hpp"
#include "symmetric.hpp"

namespace vision {

// What is known of a disc's growth before it is fitted, and the weight of that.
struct RadiusPull {
  double growth, pull;
};

using Rows = std::array<Move, kRays>;

int count(const Mask& keep);
// The matrix of the equations kept and of what is known of the radius.
Matrix normal(const Rows& rows, const Mask& keep, double pull);
// Usable rays whose levels hold nothing of a cover's.
Mask clear_of_cover(const Mask& usable);
// Kept rays without short runs of them; where many are in such runs it is no cover that cut them off.
Mask without_short_runs(const Mask& keep);
// (du, dv, growth) without the rays far off the fit, which leave `keep`; `tries` times to find them.
// None when too little of the rim is left.
std::optional<Move> robust(const Rows& rows, const Round& shift, const Mask& usable, const RadiusPull& radius,
                           int tries, Mask& keep);
// Where a change of every ray's edge, in samples, moves the centre; `scale` is that of the rows.
Vec2 moved(const Matrix& covariance, const Rows& rows, const Round& scale, const Mask& keep,
           const Round& change);

}  // namespace vision
