// A picture of three channels, 8 bits each, in place: rows, pixels and channels at any stride.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "camera.hpp"

namespace vision {

struct Colour {
  float b = 0.0F;
  float g = 0.0F;
  float r = 0.0F;
};

inline float response(const Colour& c, const Colour& weights) {
  return c.b * weights.b + c.g * weights.g + c.r * weights.r;
}

// Where a picture that is drawn in parts has pixels, and whether others were looked at.
struct Drawn {
  std::array<std::array<std::ptrdiff_t, 4>, 2> windows;  // left, top, right, bottom
  bool missed = false;

  void look(std::ptrdiff_t u, std::ptrdiff_t v, std::ptrdiff_t right, std::ptrdiff_t down) {
    for (const auto& w : windows) {
      if (u >= w[0] && v >= w[1] && u + right < w[2] && v + down < w[3]) {
        return;
      }
    }
    missed = true;
  }
};

struct Picture {
  const std::uint8_t* data;
  std::ptrdiff_t height, width;
  std::ptrdiff_t row, pixel, channel;  // strides, bytes
  Drawn* drawn = nullptr;              // none: it has all its pixels

  Colour at(std::ptrdiff_t u, std::ptrdiff_t v) const {
    const std::uint8_t* p = data + v * row + u * pixel;
    return {static_cast<float>(p[0]), static_cast<float>(p[channel]), static_cast<float>(p[2 * channel])};
  }

  bool holds(Vec2 px) const {
    return px.x >= 0.0 && px.x <= static_cast<double>(width - 1) && px.y >= 0.0 &&
           px.y <= static_cast<double>(height - 1);
  }

  // Bilinear; outside the picture the border's colour goes on.
  Colour between(Vec2 px) const {
    const double u = std::clamp(px.x, 0.0, static_cast<double>(width - 1));
    const double v = std::clamp(px.y, 0.0, static_cast<double>(height - 1));
    const auto u0 = std::min(static_cast<std::ptrdiff_t>(u), std::max<std::ptrdiff_t>(width - 2, 0));
    const auto v0 = std::min(static_cast<std::ptrdiff_t>(v), std::max<std::ptrdiff_t>(height - 2, 0));
    const auto fu = static_cast<float>(u - static_cast<double>(u0));
    const auto fv = static_cast<float>(v - static_cast<double>(v0));
    const std::uint8_t* p = data + v0 * row + u0 * pixel;
    const std::ptrdiff_t right = width > 1 ? pixel : 0;
    const std::ptrdiff_t down = height > 1 ? row : 0;
    if (drawn != nullptr) {
      drawn->look(u0, v0, width > 1 ? 1 : 0, height > 1 ? 1 : 0);
    }
    const auto mixed = [&](std::ptrdiff_t c) {
      const float a = p[c];
      const float b = p[c + right];
      const float d = p[c + down];
      const float e = p[c + down + right];
      const float top = a + fu * (b - a);
      return top + fv * (d + fu * (e - d) - top);
    };
    return {mixed(0), mixed(channel), mixed(2 * channel)};
  }
};

}  // namespace vision
