// How much each mark's colour stands out from its surroundings, all over a picture.
#pragma once

#include <array>
#include <vector>

#include "camera.hpp"
#include "picture.hpp"

namespace vision {

constexpr int kMeanPx = 5;    // of a mark in the shrunk picture
constexpr int kAboutPx = 15;  // of its surroundings

// Mean chroma over kMeanPx squares less that over kAboutPx squares, along each mark's hue, and its
// length: width x height, row by row. Squares at the border repeat the picture's last pixel.
struct Rise {
  int width, height;
  std::array<std::vector<float>, 2> along;
  std::vector<float> length2;
};

Rise rise(const Picture& picture, const std::array<Vec2, 2>& hues);

}  // namespace vision
