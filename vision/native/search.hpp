// Where marks may be in a shrunk picture, and which two of them may be the robot's; what each figure
// means is told in vision/mark_search.py.
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "camera.hpp"
#include "picture.hpp"

namespace vision {

// A place of one mark, m on the marks' plane, and what it loses in score.
struct Place {
  Vec2 centre_m;
  double loss;
};

using Places = std::vector<Place>;
using Pair = std::pair<Vec2, Vec2>;  // front and rear centre, m

class MarkSearch {
 public:
  // `hues` are the marks' directions among the two chromas, each of length 1.
  MarkSearch(const Camera& camera, double radius_m, double height_m, double distance_m,
             const std::array<Vec2, 2>& hues);

  // Places of both marks in a picture shrunk by a whole factor; `origin_px` is where its first pixel
  // has its centre in the full one.
  std::array<Places, 2> places(const Picture& picture, Vec2 origin_px, int shrink) const;

  // The likeliest pairs, best first, of places about the robot's distance apart.
  std::vector<Pair> pairs(const Places& front, const Places& rear) const;

 private:
  struct Peak {
    int u, v;
    float strength, cosine;
  };
  // A place in the full picture and what a radius on the marks' plane is there.
  struct Spot {
    Vec2 px, along, across;
    bool seen;
  };
  // What is looked at around a spot, (point, colour).
  struct Look {
    const Picture& picture;
    Vec2 origin_px;
    int shrink;

    Colour at(const Spot& spot, Vec2 point) const;
  };

  std::array<std::vector<Peak>, 2> peaks(const Picture& picture) const;
  Spot spot(Vec2 px) const;
  void centre(const Look& look, const Colour& weights, Spot& spot) const;
  // What a place loses; none where it cannot be a mark.
  std::optional<double> loss(const Look& look, const Colour& weights, const Spot& spot, float cosine) const;

  Camera camera_;
  double radius_m_, height_m_, distance_m_;
  std::array<Vec2, 2> hues_;
  std::array<Colour, 2> weights_;
  std::vector<Vec2> inner_, outer_, over_;
};

}  // namespace vision
