#include "search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "chroma.hpp"

namespace vision {
namespace {

constexpr double kTurn = 6.283185307179586;
// Rise of the mean response over a mark against its surroundings, DN: a third of a dim mark's.
constexpr float kRiseMinDn = 3.0F;
constexpr float kHueCosMin = 0.8F;      // 37 deg: coloured light, white balance, what lies beside
constexpr int kPeaksMax = 250;          // a mark and picture
constexpr std::size_t kPlacesMax = 40;  // of them, those that look most like a mark
constexpr std::size_t kPairsMax = 12;
// Where inside and outside are tried, radii from the centre.
constexpr double kInside = 0.6;
constexpr double kOutside = 1.5;
// How far off a coarse distance may be, and its standard deviation, share of a mark's radius.
constexpr double kDistanceLimit = 1.2;
constexpr double kDistanceSigma = 0.3;
// What a hypothesis loses: a rim half wrong, ground as bright as the mark, a hue 37 deg off.
constexpr double kShapeLoss = 8.0;
constexpr double kGroundLoss = 2.0;
constexpr double kHueLoss = 10.0;
constexpr double kShapeMin = 0.3;
// A peak must fall to a half this far from it, in 7 of 8 directions at least.
constexpr double kFallPx = 7.0;
constexpr int kFallMin = 7;

Vec2 circle(int i, int of) { return {std::cos(kTurn * i / of), std::sin(kTurn * i / of)}; }

// The middle of an even number of values.
float median(std::vector<float> values) {
  const std::size_t half = values.size() / 2;
  std::nth_element(values.begin(), values.begin() + half, values.end());
  return 0.5F * (values[half] + *std::max_element(values.begin(), values.begin() + half));
}

bool is_highest(const std::vector<float>& rise, int width, int height, int u, int v) {
  const float own = rise[static_cast<std::size_t>(v) * width + u];
  for (int y = std::max(v - kMeanPx / 2, 0); y <= std::min(v + kMeanPx / 2, height - 1); ++y) {
    for (int x = std::max(u - kMeanPx / 2, 0); x <= std::min(u + kMeanPx / 2, width - 1); ++x) {
      if (rise[static_cast<std::size_t>(y) * width + x] > own) {
        return false;
      }
    }
  }
  return true;
}

// Whether a peak falls off in nearly all directions: no line, no edge of a large thing.
bool is_round(const std::vector<float>& rise, int width, int height, int u, int v) {
  const float own = rise[static_cast<std::size_t>(v) * width + u];
  int low = 0;
  for (int i = 0; i < 8; ++i) {
    const Vec2 way = kFallPx * circle(i, 8);
    const int x = std::clamp(u + static_cast<int>(std::nearbyint(way.x)), 0, width - 1);
    const int y = std::clamp(v + static_cast<int>(std::nearbyint(way.y)), 0, height - 1);
    low += rise[static_cast<std::size_t>(y) * width + x] < 0.5F * own ? 1 : 0;
  }
  return low >= kFallMin;
}

}  // namespace

MarkSearch::MarkSearch(const Camera& camera, double radius_m, double height_m, double distance_m,
                       const std::array<Vec2, 2>& hues)
    : camera_(camera), radius_m_(radius_m), height_m_(height_m), distance_m_(distance_m), hues_(hues) {
  const double first = std::sqrt(0.5);
  const double second = std::sqrt(1.0 / 6.0);
  for (int k = 0; k < 2; ++k) {
    weights_[k] = {static_cast<float>(-first * hues[k].x - second * hues[k].y),
                   static_cast<float>(first * hues[k].x - second * hues[k].y),
                   static_cast<float>(2.0 * second * hues[k].y)};
  }
  inner_.push_back({0.0, 0.0});
  for (int i = 0; i < 8; ++i) {
    inner_.push_back(kInside * circle(i, 8));
  }
  for (int i = 0; i < 16; ++i) {
    outer_.push_back(kOutside * circle(i, 16));
  }
  for (int y = -4; y <= 4; ++y) {
    for (int x = -4; x <= 4; ++x) {
      const Vec2 at = 1.3 / 4.0 * Vec2{static_cast<double>(x), static_cast<double>(y)};
      if (std::hypot(at.x, at.y) <= 1.31) {
        over_.push_back(at);
      }
    }
  }
}

Colour MarkSearch::Look::at(const Spot& spot, Vec2 point) const {
  const Vec2 px = spot.px + point.x * spot.along + point.y * spot.across;
  const double u = std::nearbyint((px.x - origin_px.x) / shrink);
  const double v = std::nearbyint((px.y - origin_px.y) / shrink);
  return picture.at(static_cast<std::ptrdiff_t>(std::clamp(u, 0.0, static_cast<double>(picture.width - 1))),
                    static_cast<std::ptrdiff_t>(std::clamp(v, 0.0, static_cast<double>(picture.height - 1))));
}

std::array<std::vector<MarkSearch::Peak>, 2> MarkSearch::peaks(const Picture& picture) const {
  // Against its surroundings, so that a coloured floor is not a mark.
  const Rise all = rise(picture, hues_);
  std::array<std::vector<Peak>, 2> found;
  for (int k = 0; k < 2; ++k) {
    const std::vector<float>& along = all.along[k];
    for (int v = 0; v < all.height; ++v) {
      for (int u = 0; u < all.width; ++u) {
        const std::size_t cell = static_cast<std::size_t>(v) * all.width + u;
        const float own = along[cell];
        if (!(own > kRiseMinDn) || own * own <= kHueCosMin * kHueCosMin * all.length2[cell] ||
            !is_highest(along, all.width, all.height, u, v) ||
            !is_round(along, all.width, all.height, u, v)) {
          continue;
        }
        found[k].push_back({u, v, own, own / std::sqrt(all.length2[cell])});
      }
    }
    std::stable_sort(found[k].begin(), found[k].end(),
                     [](const Peak& a, const Peak& b) { return a.strength > b.strength; });
    if (found[k].size() > kPeaksMax) {
      found[k].resize(kPeaksMax);
    }
  }
  return found;
}

MarkSearch::Spot MarkSearch::spot(Vec2 px) const {
  const Vec2 floor = camera_.floor_point(px, height_m_);
  const Vec2 at = camera_.project(floor, height_m_);
  const Vec2 along = camera_.project(floor + Vec2{radius_m_, 0.0}, height_m_) - at;
  const Vec2 across = camera_.project(floor + Vec2{0.0, radius_m_}, height_m_) - at;
  const bool seen = std::isfinite(along.x + along.y + across.x + across.y);
  return {px, along, across, seen};
}

void MarkSearch::centre(const Look& look, const Colour& weights, Spot& spot) const {
  std::vector<float> outer;
  for (const Vec2 point : outer_) {
    outer.push_back(response(look.at(spot, point), weights));
  }
  std::vector<float> value;
  for (const Vec2 point : over_) {
    value.push_back(response(look.at(spot, point), weights));
  }
  const float top = *std::max_element(value.begin(), value.end());
  const float level = 0.6F * median(outer) + 0.4F * top;
  Vec2 move;
  double total = 0.0;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const double weight = std::max(value[i] - level, 0.0F);
    move = move + weight * over_[i];
    total += weight;
  }
  move = 1.0 / std::max(total, 1e-6) * move;
  spot.px = spot.px + move.x * spot.along + move.y * spot.across;
}

std::optional<double> MarkSearch::loss(const Look& look, const Colour& weights, const Spot& spot,
                                       float cosine) const {
  std::vector<float> inside;
  std::vector<float> outside;
  double bright = 0.0;
  double ground = 0.0;
  for (const Vec2 point : inner_) {
    const Colour c = look.at(spot, point);
    inside.push_back(response(c, weights));
    bright += (c.b + c.g + c.r) / (3.0 * static_cast<double>(inner_.size()));
  }
  for (const Vec2 point : outer_) {
    const Colour c = look.at(spot, point);
    outside.push_back(response(c, weights));
    ground += (c.b + c.g + c.r) / (3.0 * static_cast<double>(outer_.size()));
  }
  const float low = median(outside);
  std::vector<float> ordered = inside;
  std::nth_element(ordered.begin(), ordered.begin() + 5, ordered.end());
  const float high = ordered[5];
  const float middle = 0.5F * (low + high);
  const auto share = [](const std::vector<float>& values, auto&& test) {
    return static_cast<double>(std::count_if(values.begin(), values.end(), test)) /
           static_cast<double>(values.size());
  };
  const double shape = share(inside, [&](float value) { return value > middle; }) +
                       share(outside, [&](float value) { return value < middle; }) - 1.0;
  if (!(shape > kShapeMin && high - low > kRiseMinDn)) {
    return std::nullopt;
  }
  return kShapeLoss * (1.0 - shape) +
         kGroundLoss * std::clamp(ground / std::max(bright, 1.0) - 0.5, 0.0, 3.0) +
         kHueLoss * (1.0 - static_cast<double>(cosine));
}

std::array<Places, 2> MarkSearch::places(const Picture& picture, Vec2 origin_px, int shrink) const {
  const std::array<std::vector<Peak>, 2> all = peaks(picture);
  const Look look{picture, origin_px, shrink};
  std::array<Places, 2> found;
  for (int k = 0; k < 2; ++k) {
    for (const Peak& peak : all[k]) {
      const Vec2 cell = {static_cast<double>(peak.u), static_cast<double>(peak.v)};
      Spot at = spot(static_cast<double>(shrink) * cell + origin_px);
      if (!at.seen) {
        continue;
      }
      centre(look, weights_[k], at);
      if (const std::optional<double> lost = loss(look, weights_[k], at, peak.cosine)) {
        found[k].push_back({at.px, *lost});
      }
    }
    std::stable_sort(found[k].begin(), found[k].end(),
                     [](const Place& a, const Place& b) { return a.loss < b.loss; });
    if (found[k].size() > kPlacesMax) {
      found[k].resize(kPlacesMax);
    }
    for (Place& place : found[k]) {
      place.centre_m = camera_.floor_point(place.centre_m, height_m_);
    }
  }
  return found;
}

std::vector<Pair> MarkSearch::pairs(const Places& front, const Places& rear) const {
  struct Scored {
    double loss;
    Pair pair;
  };
  std::vector<Scored> all;
  for (const Place& f : front) {
    for (const Place& r : rear) {
      const Vec2 away = f.centre_m - r.centre_m;
      const double misfit = (std::hypot(away.x, away.y) - distance_m_) / radius_m_;
      if (std::abs(misfit) < kDistanceLimit) {
        const double sigmas = misfit / kDistanceSigma;
        all.push_back({f.loss + r.loss + 0.5 * sigmas * sigmas, {f.centre_m, r.centre_m}});
      }
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Scored& a, const Scored& b) { return a.loss < b.loss; });
  std::vector<Pair> best;
  for (std::size_t i = 0; i < std::min(all.size(), kPairsMax); ++i) {
    best.push_back(all[i].pair);
  }
  return best;
}

}  // namespace vision
