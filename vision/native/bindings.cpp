// Python module vision._marks: measuring and searching of colour marks.
// Signatures and units for Python readers: vision/_marks.pyi.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "disc_fit.hpp"
#include "place.hpp"
#include "search.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using vision::Camera;
using vision::Colour;
using vision::Disc;
using vision::MarkSearch;
using vision::Picture;
using vision::Place;
using vision::Places;
using vision::RimFitter;
using vision::Vec2;

using Image = nb::ndarray<const std::uint8_t, nb::ndim<3>, nb::device::cpu>;
using Point = std::pair<double, double>;
using Scored = std::array<double, 3>;  // x_m, y_m, loss

Picture view(const Image& image) {
  if (image.shape(2) != 3 || image.shape(0) == 0 || image.shape(1) == 0) {
    throw nb::value_error("image: must be (H, W, 3), neither empty");
  }
  return {image.data(),
          static_cast<std::ptrdiff_t>(image.shape(0)),
          static_cast<std::ptrdiff_t>(image.shape(1)),
          static_cast<std::ptrdiff_t>(image.stride(0)),
          static_cast<std::ptrdiff_t>(image.stride(1)),
          static_cast<std::ptrdiff_t>(image.stride(2))};
}

Colour colour(const std::array<double, 3>& bgr) {
  return {static_cast<float>(bgr[0]), static_cast<float>(bgr[1]), static_cast<float>(bgr[2])};
}

Vec2 point(const Point& p) { return {p.first, p.second}; }

Places places_of(const std::vector<Scored>& rows) {
  Places places;
  for (const auto& [x_m, y_m, loss] : rows) {
    places.push_back({{x_m, y_m}, loss});
  }
  return places;
}

std::vector<Scored> rows_of(const Places& places) {
  std::vector<Scored> rows;
  for (const Place& place : places) {
    rows.push_back({place.centre_m.x, place.centre_m.y, place.loss});
  }
  return rows;
}

void bind_rims(nb::module_& m) {
  nb::class_<Disc>(m, "Disc")
      .def_ro("u_px", &Disc::u_px)
      .def_ro("v_px", &Disc::v_px)
      .def_ro("radius_px", &Disc::radius_px)
      .def_ro("growth", &Disc::growth)
      .def_ro("share", &Disc::share)
      .def_ro("residual_px", &Disc::residual_px)
      .def_ro("covariance_px2", &Disc::covariance_px2)
      .def_ro("contrast_dn", &Disc::contrast_dn)
      .def_ro("ground_ratio", &Disc::ground_ratio)
      .def_ro("square", &Disc::square)
      .def_prop_ro("beyond", [](const Disc& disc) { return disc.beside.beyond; })
      .def_prop_ro("hollow", [](const Disc& disc) { return disc.beside.hollow; });
  nb::class_<RimFitter>(m, "RimFitter")
      .def(
          "__init__",
          [](RimFitter* self, const Camera& camera, double radius_m, double height_m,
             const std::array<std::array<double, 3>, 2>& weights, const Point& middle_px) {
            new (self) RimFitter(camera, radius_m, height_m, {colour(weights[0]), colour(weights[1])},
                                 point(middle_px));
          },
          "camera"_a, "radius_m"_a, "height_m"_a, "weights"_a, "middle_px"_a)
      .def(
          "fit",
          [](const RimFitter& fitter, const Image& image,
             const std::array<Point, 2>& centres_m) -> std::optional<std::pair<Disc, Disc>> {
            const auto discs = fitter.fit(view(image), {point(centres_m[0]), point(centres_m[1])});
            if (!discs) {
              return std::nullopt;
            }
            return std::pair((*discs)[0], (*discs)[1]);
          },
          "image"_a, "centres_m"_a)
      .def(
          "window",
          [](const RimFitter& fitter, const Point& centre_m, int width, int height) {
            return fitter.window(point(centre_m), width, height);
          },
          "centre_m"_a, "width"_a, "height"_a)
      .def(
          "fit_within",
          [](const RimFitter& fitter, const Image& image, const std::array<Point, 2>& centres_m,
             const std::array<std::array<std::ptrdiff_t, 4>, 2>& windows) {
            vision::Drawn drawn{windows};
            Picture picture = view(image);
            picture.drawn = &drawn;
            const auto discs = fitter.fit(picture, {point(centres_m[0]), point(centres_m[1])});
            std::optional<std::pair<Disc, Disc>> found;
            if (discs) {
              found = std::pair((*discs)[0], (*discs)[1]);
            }
            return std::pair(found, drawn.missed);
          },
          "image"_a, "centres_m"_a, "windows"_a);
}

void bind_place(nb::module_& m) {
  using vision::Placed;
  using vision::Spot;
  nb::class_<Spot>(m, "Spot")
      .def(
          "__init__",
          [](Spot* self, const Point& at_m, const std::array<double, 4>& spread_m2) {
            const auto& [xx, xy, yx, yy] = spread_m2;
            new (self) Spot{point(at_m), {{{xx, xy}, {yx, yy}}}};
          },
          "at_m"_a, "spread_m2"_a)
      .def_prop_ro("at_m", [](const Spot& s) { return Point(s.at_m.x, s.at_m.y); })
      .def_prop_ro("spread_m2", [](const Spot& s) {
        const auto& [top, bottom] = s.spread_m2;
        return std::array<double, 4>{top[0], top[1], bottom[0], bottom[1]};
      });
  m.def(
      "spot",
      [](const Camera& camera, const Disc& disc, double height_m) {
        return vision::spot(camera, {disc.u_px, disc.v_px}, disc.covariance_px2, height_m);
      },
      "camera"_a, "disc"_a, "height_m"_a);
  m.def("gap_variance", &vision::gap_variance, "one"_a, "other"_a, "length_m"_a);
  m.def(
      "weighted_pose",
      [](const std::array<Point, 2>& body_m, const Spot& one, const Spot& other) {
        const Placed p = vision::weighted_pose({point(body_m[0]), point(body_m[1])}, {one, other});
        const auto& c = p.covariance;
        return nb::make_tuple(p.x_m, p.y_m, p.theta_rad,
                              nb::make_tuple(c[0][0], c[0][1], c[0][2], c[1][1], c[1][2], c[2][2]), p.left);
      },
      "body_m"_a, "one"_a, "other"_a);
}

void bind_search(nb::module_& m) {
  nb::class_<MarkSearch>(m, "MarkSearch")
      .def(
          "__init__",
          [](MarkSearch* self, const Camera& camera, double radius_m, double height_m, double distance_m,
             const std::array<Point, 2>& hues) {
            new (self) MarkSearch(camera, radius_m, height_m, distance_m, {point(hues[0]), point(hues[1])});
          },
          "camera"_a, "radius_m"_a, "height_m"_a, "distance_m"_a, "hues"_a)
      .def(
          "places",
          [](const MarkSearch& search, const Image& image, const Point& origin_px, int shrink) {
            const auto found = search.places(view(image), point(origin_px), shrink);
            return std::pair(rows_of(found[0]), rows_of(found[1]));
          },
          "image"_a, "origin_px"_a, "shrink"_a)
      .def(
          "pairs",
          [](const MarkSearch& search, const std::vector<Scored>& front, const std::vector<Scored>& rear) {
            std::vector<std::pair<Point, Point>> rows;
            for (const auto& [f, r] : search.pairs(places_of(front), places_of(rear))) {
              rows.push_back({{f.x, f.y}, {r.x, r.y}});
            }
            return rows;
          },
          "front"_a, "rear"_a);
}

}  // namespace

NB_MODULE(_marks, m) {
  nb::class_<Camera>(m, "Camera")
      .def(
          "__init__",
          [](Camera* self, const std::array<double, 4>& lens, const std::array<double, 5>& distortion,
             const std::array<double, 9>& rotation, const std::array<double, 3>& centre_m, bool fisheye,
             const std::array<double, 3>& below) {
            new (self) Camera{lens, distortion, rotation, centre_m, fisheye, below};
          },
          "lens"_a, "distortion"_a, "rotation"_a, "centre_m"_a, "fisheye"_a = false,
          "below"_a = std::array<double, 3>{});
  bind_rims(m);
  bind_place(m);
  bind_search(m);
}
