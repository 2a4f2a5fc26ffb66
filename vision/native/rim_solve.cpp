#include "rim_solve.hpp"

#include <algorithm>
#include <cmath>

namespace vision {
namespace {

constexpr double kOutlierSigmas = 3.0;
// Of five rays side by side, more of which must have an edge for that in the middle.
constexpr int kBesideMin = 3;
// So few kept rays side by side lie between two parts of a cover, whose levels they share.
constexpr int kRunMin = 4;
constexpr double kEdgeSigmaMinPx = 0.05;

// (du, dv, growth) by least squares; none when too little of the rim is left.
std::optional<Move> solved(const Rows& rows, const Round& shift, const Mask& keep, const RadiusPull& radius) {
  if (count(keep) < kRays / 6) {
    return std::nullopt;
  }
  const std::optional<Matrix> covariance = inverse(normal(rows, keep, radius.pull));
  if (!covariance) {
    return std::nullopt;
  }
  Move right = {0.0, 0.0, radius.pull * radius.growth};
  for (int ray = 0; ray < kRays; ++ray) {
    for (int i = 0; keep[ray] && i < 3; ++i) {
      right[i] += rows[ray][i] * shift[ray];
    }
  }
  return Move{dot3((*covariance)[0], right), dot3((*covariance)[1], right), dot3((*covariance)[2], right)};
}

// A robust standard deviation of kept residuals: 1.48 of their median.
double spread(const Round& rest, const Mask& keep) {
  std::array<double, kRays> kept;
  int n = 0;
  for (int ray = 0; ray < kRays; ++ray) {
    if (keep[ray]) {
      kept[n++] = rest[ray];
    }
  }
  std::nth_element(kept.begin(), kept.begin() + n / 2, kept.begin() + n);
  return std::max(1.4826 * kept[n / 2], kEdgeSigmaMinPx);
}

}  // namespace

int count(const Mask& keep) { return static_cast<int>(std::count(keep.begin(), keep.end(), true)); }

Matrix normal(const Rows& rows, const Mask& keep, double pull) {
  Matrix n = {};
  for (int ray = 0; ray < kRays; ++ray) {
    for (int i = 0; keep[ray] && i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        n[i][j] += rows[ray][i] * rows[ray][j];
      }
    }
  }
  n[2][2] += pull;
  return n;
}

// Usable rays whose levels hold nothing of a cover's: levels are means over neighbouring rays, and two
// rays side by side that show no edge are something in front; one alone is noise.
Mask clear_of_cover(const Mask& usable) {
  Mask clear;
  for (int ray = 0; ray < kRays; ++ray) {
    const auto shown = [&](int away) { return usable[(ray + away + kRays) % kRays]; };
    int beside = 0;
    for (int k = -2; k <= 2; ++k) {
      beside += shown(k) ? 1 : 0;
    }
    clear[ray] = usable[ray] && beside > kBesideMin;
    for (int k = -kLevelRays / 2 - 1; k <= kLevelRays / 2; ++k) {
      clear[ray] = clear[ray] && (shown(k) || shown(k + 1));
    }
  }
  return clear;
}

Mask without_short_runs(const Mask& keep) {
  Mask long_runs = keep;
  for (int first = 0; first < kRays; ++first) {
    int length = 0;
    while (length < kRunMin && keep[(first + length) % kRays]) {
      ++length;
    }
    const bool starts = !keep[(first + kRays - 1) % kRays];
    for (int i = 0; starts && length < kRunMin && i < length; ++i) {
      long_runs[(first + i) % kRays] = false;
    }
  }
  return 4 * count(long_runs) < 3 * count(keep) ? keep : long_runs;
}

std::optional<Move> robust(const Rows& rows, const Round& shift, const Mask& usable, const RadiusPull& radius,
                           int tries, Mask& keep) {
  for (int i = 0; i < tries; ++i) {
    const std::optional<Move> move = solved(rows, shift, without_short_runs(keep), radius);
    if (!move) {
      return std::nullopt;
    }
    Round rest;
    for (int ray = 0; ray < kRays; ++ray) {
      rest[ray] = std::abs(shift[ray] - dot3(rows[ray], *move));
    }
    const double limit = kOutlierSigmas * spread(rest, keep);
    Mask within;
    for (int ray = 0; ray < kRays; ++ray) {
      within[ray] = usable[ray] && rest[ray] < limit;
    }
    if (within == keep) {
      return move;
    }
    keep = within;
  }
  return solved(rows, shift, without_short_runs(keep), radius);
}

Vec2 moved(const Matrix& covariance, const Rows& rows, const Round& scale, const Mask& keep,
           const Round& change) {
  Move right = {};
  for (int ray = 0; ray < kRays; ++ray) {
    for (int i = 0; keep[ray] && i < 3; ++i) {
      right[i] += rows[ray][i] * scale[ray] * change[ray];
    }
  }
  return {dot3(covariance[0], right), dot3(covariance[1], right)};
}

}  // namespace vision
