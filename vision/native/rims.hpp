// Edges across the rim of a disc, found by sums over profiles of several lengths.
//
// A profile runs from inside to outside. Its edge lies where the mean between two levels, taken at
// its ends, says. A blurred edge fills a short profile, whose ends then move with the edge: it says
// little of where the edge is, and that is measured here as the gain of each profile, how far its
// answer moves when the profile is moved by one sample. Of the lengths tried the one that says most
// counts, so that along the motion profiles are long and across it short.
#pragma once

#include <array>
#include <vector>

namespace vision {

constexpr int kRays = 48;
constexpr int kLengths = 4;
// Rays over which an edge's two levels are averaged: a sixth of the rim follows a shadow's edge.
constexpr int kLevelRays = 7;

using Round = std::array<double, kRays>;
using Mask = std::array<bool, kRays>;

// Edges along the profiles of one disc: `shift` in samples, outwards; `gain` what a shift of the
// disc by one sample does to it; `noise` its standard deviation for a noise of 1 DN; `typical_dn`
// the disc's response, `lean` by how much the first turn of its levels was grown. `ground` and `cover` are how far the shift would move if the level outside, or
// a level inside that is much too low, were that round most of the disc.
struct Edges {
  Round shift, gain, noise, ground, cover;
  Mask usable;
  double typical_dn;
  double lean;
};

// The sums that turn profiles into edges. A profile has 2 `half` + 1 samples about a px apart;
// `edge` of them, on each side of its middle, are the longest reach.
class Profiles {
 public:
  explicit Profiles(double radius_px);

  int edge() const { return ends_[kLengths - 1]; }
  int half() const { return half_; }
  int samples() const { return 2 * half_ + 1; }
  // The first of two samples next to the rim: inside, and outside.
  int own() const { return half_ - edge_[0] - 2; }
  int ground() const { return half_ + edge_[0] + 1; }

  // Edges of profiles, kRays x samples().
  Edges edges(const std::vector<float>& response) const;

 private:
  std::array<int, kLengths> edge_, ends_, level_;
  std::array<double, kLengths> lean_;
  int half_;
};

// How far from the rim an edge is looked for, px, for a disc of this radius.
double reach_px(double radius_px);

}  // namespace vision
