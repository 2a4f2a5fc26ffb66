#include "disc_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rim_solve.hpp"

namespace vision {
namespace {

constexpr double kTurn = 6.283185307179586;
constexpr int kSteps = 6;
// Before them the centroid of the response, twice: of points in rings up to 1.5 radii.
constexpr int kCentroids = 2;
constexpr double kCentredPx = 1.0;  // after a move shorter than that one is enough
constexpr int kPolarRays = 16;
constexpr std::array<double, 6> kPolarRadii = {0.3, 0.6, 0.85, 1.05, 1.25, 1.5};
constexpr double kGuessPx = 3.0;        // by which a guess is mostly off at most
constexpr double kCentroidLevel = 0.4;  // of the way from the surroundings to the highest response
// A step this short ends the fit; after one longer than that all rays count again.
constexpr double kSettledPx = 0.03;
constexpr double kRekeepPx = 0.5;
// Rays are as close together as they are so far inside, in radii; the least length of one, relative.
constexpr double kInside = 0.25;
constexpr double kLengthMin = 0.1;
constexpr double kOffMax = 0.4;  // of the radius: a square's corners
// Doubt of the radius before the fit, relative, as a pull towards the known one.
constexpr double kRadiusSigma = 0.02;
constexpr double kRadiusPull = (0.15 / kRadiusSigma) * (0.15 / kRadiusSigma);
// And as one towards that of the other disc, of which more is seen: light, blur and lens grow both alike.
constexpr double kAlikeSigma = 0.0027;
constexpr double kAlikeMax = 0.03;  // off it a disc is of another size
constexpr double kAlikePull = (0.15 / kAlikeSigma) * (0.15 / kAlikeSigma);

}  // namespace

RimFitter::RimFitter(const Camera& camera, double radius_m, double height_m,
                     const std::array<Colour, 2>& weights, Vec2 middle_px)
    : camera_(camera), radius_m_(radius_m), height_m_(height_m), weights_(weights), profiles_(1.0) {
  for (int ray = 0; ray < kRays; ++ray) {
    const double angle = kTurn * ray / kRays;
    circle_m_[ray] = {radius_m_ * std::cos(angle), radius_m_ * std::sin(angle)};
  }
  if (const std::optional<Shape> typical = shape(middle_px)) {
    profiles_ = Profiles(typical->radius_px);
  }
}

std::optional<RimFitter::Shape> RimFitter::shape(Vec2 px) const {
  const Vec2 floor = camera_.floor_point(px, height_m_);
  const Vec2 centre = camera_.project(floor, height_m_);
  Shape found;
  double reach = 0.0;
  for (int ray = 0; ray < kRays; ++ray) {
    found.arms[ray] = camera_.project(floor + circle_m_[ray], height_m_) - centre;
    reach = std::max({reach, std::abs(found.arms[ray].x), std::abs(found.arms[ray].y)});
  }
  double radius = 0.0;
  double around = 0.0;
  for (int ray = 0; ray < kRays; ++ray) {
    const Vec2 along = found.arms[(ray + 1) % kRays] - found.arms[(ray + kRays - 1) % kRays];
    found.length[ray] = std::hypot(along.x, along.y);
    around += found.length[ray] / kRays;
    // Seen from above a circle keeps its turning sense, and image rows run down.
    found.normals[ray] = 1.0 / found.length[ray] * Vec2{-along.y, along.x};
    radius += dot(found.normals[ray], found.arms[ray]) / kRays;
  }
  if (!(radius > 1.0)) {
    return std::nullopt;
  }
  // Rays run together inwards, the more so where the rim is bent more.
  const double inside = kInside * radius / around;
  for (int ray = 0; ray < kRays; ++ray) {
    const Vec2 before = found.normals[(ray + kRays - 1) % kRays];
    const Vec2 after = found.normals[(ray + 1) % kRays];
    const double bent = std::abs(before.x * after.y - before.y * after.x);
    found.length[ray] = std::max(found.length[ray] / around - inside * bent, kLengthMin);
  }
  found.radius_px = radius;
  found.step_px = reach_px(radius) / profiles_.edge();
  found.room_px = reach + found.step_px * profiles_.half() + 1.0;
  return found;
}

std::optional<std::array<int, 4>> RimFitter::window(Vec2 centre_m, int width, int height) const {
  const Vec2 px = camera_.project(centre_m, height_m_);
  const std::optional<Shape> rim = shape(px);
  if (!rim) {
    return std::nullopt;
  }
  const double room = std::max(rim->room_px, kPolarRadii.back() * rim->radius_px) + kGuessPx;
  const auto bound = [](double p, int most) {
    return static_cast<int>(std::clamp(p, 0.0, static_cast<double>(most)));
  };
  return std::array<int, 4>{bound(px.x - room, width), bound(px.y - room, height),
                            bound(px.x + room + 2.0, width), bound(px.y + room + 2.0, height)};
}

std::optional<Vec2> RimFitter::centred(const Picture& picture, Vec2 px, const Colour& weights) const {
  const std::optional<Shape> rim = shape(px);
  if (!rim) {
    return std::nullopt;
  }
  std::array<double, kPolarRadii.size() * kPolarRays> value;
  std::array<double, kPolarRays> outer;
  double top = -std::numeric_limits<double>::infinity();
  for (std::size_t ring = 0; ring < kPolarRadii.size(); ++ring) {
    for (int i = 0; i < kPolarRays; ++i) {
      const Vec2 arm = kPolarRadii[ring] * rim->arms[i * (kRays / kPolarRays)];
      value[ring * kPolarRays + i] = outer[i] = response(picture.between(px + arm), weights);
      top = std::max(top, outer[i]);
    }
  }
  std::nth_element(outer.begin(), outer.begin() + kPolarRays / 2, outer.end());
  const double base = outer[kPolarRays / 2];
  const double level = base + kCentroidLevel * (top - base);
  Vec2 move;
  double total = 0.0;
  for (std::size_t k = 0; k < value.size(); ++k) {
    const double radius = kPolarRadii[k / kPolarRays];
    const double weight = std::max(value[k] - level, 0.0) * radius;
    move = move + weight * radius * rim->arms[k % kPolarRays * (kRays / kPolarRays)];
    total += weight;
  }
  return px + 1.0 / std::max(total, 1e-6) * move;
}

Mask RimFitter::within(const Picture& picture, Vec2 px, const Shape& shape) const {
  Mask seen;
  const double reach = shape.step_px * profiles_.half();
  for (int ray = 0; ray < kRays; ++ray) {
    const Vec2 at = px + shape.arms[ray];
    seen[ray] =
        picture.holds(at + reach * shape.normals[ray]) && picture.holds(at - reach * shape.normals[ray]);
  }
  return seen;
}

bool RimFitter::step(const Picture& picture, Vec2 px, const Colour& weights, const Mask* keep,
                     const Step* other, Step& done) const {
  const std::optional<Shape> rim = shape(px);
  if (!rim) {
    return false;
  }
  done.shape = *rim;
  done.from_px = px;
  const int samples = profiles_.samples();
  std::vector<float> values(kRays * samples);
  for (int ray = 0; ray < kRays; ++ray) {
    for (int i = 0; i < samples; ++i) {
      const double out = rim->step_px * (i - profiles_.half());
      const Vec2 at = px + rim->arms[ray] + out * rim->normals[ray];
      values[ray * samples + i] = response(picture.between(at), weights);
    }
  }
  done.edges = profiles_.edges(values);
  const Mask seen = within(picture, px, *rim);
  Mask usable;
  for (int ray = 0; ray < kRays; ++ray) {
    usable[ray] = done.edges.usable[ray] && seen[ray];
  }
  const Mask whole = clear_of_cover(usable);
  // Where rays are closer together they share more pixels, and each says less.
  Round precision;
  double information = 0.0;
  for (int ray = 0; ray < kRays; ++ray) {
    const double noise = done.edges.noise[ray];
    precision[ray] = rim->length[ray] / (noise * noise);
    information += precision[ray] / kRays;
  }
  const double scale = 1.0 / std::sqrt(information);
  for (int ray = 0; ray < kRays; ++ray) {
    const double weight = scale * std::sqrt(precision[ray]);
    const Vec2 n = rim->normals[ray];
    const double pull = done.edges.gain[ray] * weight;
    done.rows[ray] = {n.x * pull, n.y * pull, dot(n, rim->arms[ray]) * pull};
    done.scale[ray] = rim->step_px * weight;
    done.shift[ray] = done.edges.shift[ray] * done.scale[ray];
  }
  done.keep = whole;
  for (int ray = 0; keep != nullptr && ray < kRays; ++ray) {
    done.keep[ray] = whole[ray] && (*keep)[ray];
  }
  done.radius = {0.0, kRadiusPull};
  const int tries = keep == nullptr ? 2 : 1;
  std::optional<Move> move = robust(done.rows, done.shift, whole, done.radius, tries, done.keep);
  const bool less = move && other != nullptr && count(done.keep) < count(other->keep);
  if (less && std::abs((*move)[2] - other->move[2]) < kAlikeMax) {
    done.radius = {other->move[2], kAlikePull};
    move = robust(done.rows, done.shift, whole, done.radius, tries, done.keep);
  }
  if (move) {
    done.move = *move;
  }
  return move.has_value();
}

Disc RimFitter::disc(const Picture& picture, const Step& step, Evidence& evidence) const {
  const auto& [du, dv, growth] = step.move;
  const Mask used = without_short_runs(step.keep);
  Round rest = {};
  Round off;
  std::vector<float> ratios;
  double squares = 0.0;
  double gain = 0.0;
  int shown = 0;
  const auto brightness = [&](int ray, int first) {
    float sum = 0.0F;
    for (int i = first; i < first + 2; ++i) {
      const double out = step.shape.step_px * (i - profiles_.half());
      const Vec2 at = step.from_px + step.shape.arms[ray] + out * step.shape.normals[ray];
      const Colour c = picture.between(at);
      sum += c.b + c.g + c.r;
    }
    return sum;
  };
  for (int ray = 0; ray < kRays; ++ray) {
    const double left = step.shift[ray] - dot3(step.rows[ray], step.move);
    off[ray] = std::clamp(left, -kOffMax * step.shape.radius_px, kOffMax * step.shape.radius_px);
    shown += step.keep[ray] ? 1 : 0;
    if (used[ray]) {
      rest[ray] = left;
      squares += rest[ray] * rest[ray];
      gain += step.edges.gain[ray];
      ratios.push_back(brightness(ray, profiles_.ground()) /
                       std::max(brightness(ray, profiles_.own()), 1.0F));
    }
  }
  const int kept = static_cast<int>(ratios.size());
  std::nth_element(ratios.begin(), ratios.begin() + kept / 2, ratios.end());
  const double share = static_cast<double>(kept) / kRays;
  const Matrix centre = inverse(normal(step.rows, used, step.radius.pull)).value_or(Matrix{});
  evidence = {rim_noise(rest, kept),
              {centre[0][0], centre[0][1], centre[1][1]},
              moved(centre, step.rows, step.scale, used, step.edges.ground),
              moved(centre, step.rows, step.scale, used, step.edges.cover),
              step.shape.radius_px,
              share,
              gain / kept,
              step.edges.typical_dn,
              step.edges.lean};
  return Disc{step.from_px.x + du,
              step.from_px.y + dv,
              step.shape.radius_px,
              growth,
              static_cast<double>(shown) / kRays,
              std::sqrt(squares / kept),
              {},
              step.edges.typical_dn,
              ratios[kept / 2],
              squareness(off),
              {}};
}

std::optional<std::array<Disc, 2>> RimFitter::fit(const Picture& picture,
                                                  const std::array<Vec2, 2>& centres_m) const {
  std::array<Vec2, 2> px = {camera_.project(centres_m[0], height_m_),
                            camera_.project(centres_m[1], height_m_)};
  for (int i = 0; i < kCentroids; ++i) {
    double far_px = 0.0;
    for (int k = 0; k < 2; ++k) {
      const std::optional<Vec2> moved = centred(picture, px[k], weights_[k]);
      if (!moved) {
        return std::nullopt;
      }
      far_px = std::max({far_px, std::abs(moved->x - px[k].x), std::abs(moved->y - px[k].y)});
      px[k] = *moved;
    }
    if (far_px < kCentredPx) {
      break;
    }
  }
  std::array<Step, 2> steps;
  std::array<Mask, 2> keep;
  bool all_rays = true;
  for (int i = 0; i < kSteps; ++i) {
    double far_px = 0.0;
    for (int k = 0; k < 2; ++k) {
      const Step* other = i + k > 0 ? &steps[1 - k] : nullptr;
      if (!step(picture, px[k], weights_[k], all_rays ? nullptr : &keep[k], other, steps[k])) {
        return std::nullopt;
      }
      const Move& move = steps[k].move;
      px[k] = px[k] + Vec2{move[0], move[1]};
      keep[k] = steps[k].keep;
      far_px = std::max({far_px, std::abs(move[0]), std::abs(move[1])});
    }
    if (far_px < kSettledPx && (i > 0 || count(keep[0]) >= count(keep[1]))) {
      break;
    }
    all_rays = far_px > kRekeepPx;
  }
  std::array<Evidence, 2> shown;
  std::array<Disc, 2> discs = {disc(picture, steps[0], shown[0]), disc(picture, steps[1], shown[1])};
  for (int k = 0; k < 2; ++k) {
    discs[k].covariance_px2 = claim(shown[k], shown[1 - k]);
    std::array<Vec2, kRays> rim;
    for (int ray = 0; ray < kRays; ++ray) {
      rim[ray] = (1.0 + discs[k].growth) * steps[k].shape.arms[ray];
    }
    const Vec2 centre_px = {discs[k].u_px, discs[k].v_px};
    discs[k].beside = beside(picture, centre_px, rim, weights_[k], discs[k].contrast_dn);
  }
  return discs;
}

}  // namespace vision
