// Discs of known size measured at their rims; what each step does is told in vision/disc_fit.py.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "beside.hpp"
#include "camera.hpp"
#include "claim.hpp"
#include "picture.hpp"
#include "rim_solve.hpp"
#include "rims.hpp"
#include "symmetric.hpp"

namespace vision {

// One fitted disc. (u, v) is the image of its centre, `growth` its radius over the known one less 1,
// `share` the part of its rim that was seen, `residual_px` the RMS of those edges, the covariance
// that of (u, v), `ground_ratio` the brightness beside it over its own, `square` is near 1
// for one that has four corners, `beside` what goes on beyond its rim and is not in its middle.
struct Disc {
  double u_px, v_px, radius_px, growth, share, residual_px;
  std::array<double, 3> covariance_px2;  // uu, uv, vv
  double contrast_dn, ground_ratio, square;
  Beside beside;
};

class RimFitter {
 public:
  RimFitter(const Camera& camera, double radius_m, double height_m, const std::array<Colour, 2>& weights,
            Vec2 middle_px);

  // Both discs from guesses of their centres, m on their plane, off by half of the radius at most;
  // none where a disc is out of view or has no edge.
  std::optional<std::array<Disc, 2>> fit(const Picture& picture, const std::array<Vec2, 2>& centres_m) const;
  // The part of a picture in which a fit from such a guess mostly looks: left, top, right, bottom.
  std::optional<std::array<int, 4>> window(Vec2 centre_m, int width, int height) const;

 private:
  // The rim seen about a pixel: arms from the image of its centre, and normals outwards.
  struct Shape {
    std::array<Vec2, kRays> arms, normals;
    Round length;  // of rim that a ray stands for; 1 on average
    double radius_px;
    double step_px;  // between the samples of a profile
    double room_px;  // what the profiles need about the centre
  };
  // One step of one disc: the equations solved, each divided by its expected noise, in px.
  struct Step {
    Shape shape;
    Vec2 from_px;  // centre before the step
    Edges edges;
    std::array<Move, kRays> rows;
    Round shift, scale;  // `scale`: from samples to the units of `rows`
    Mask keep;
    RadiusPull radius;
    Move move;
  };

  std::optional<Shape> shape(Vec2 px) const;
  std::optional<Vec2> centred(const Picture& picture, Vec2 px, const Colour& weights) const;
  bool step(const Picture& picture, Vec2 px, const Colour& weights, const Mask* keep, const Step* other,
            Step& done) const;
  Mask within(const Picture& picture, Vec2 px, const Shape& shape) const;
  // The figures of a fitted disc but for its covariance, and what that rests on.
  Disc disc(const Picture& picture, const Step& step, Evidence& evidence) const;

  Camera camera_;
  double radius_m_, height_m_;
  std::array<Colour, 2> weights_;
  std::array<Vec2, kRays> circle_m_;
  Profiles profiles_;
};

}  // namespace vision
