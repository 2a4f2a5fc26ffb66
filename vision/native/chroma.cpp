#include "chroma.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vision {
namespace {

constexpr int kReach = kAboutPx / 2;
constexpr int kNear = kMeanPx / 2;

// Twice a chroma in whole numbers: green less blue, and twice red less both. Exact in sums.
using Row = std::vector<std::int32_t>;

struct Sums {
  Row near, about;  // over kMeanPx and kAboutPx rows
};

// A row of the picture as one chroma, with kReach repeated pixels at each end.
void chroma_row(const Picture& picture, std::ptrdiff_t v, Row& green_blue, Row& red) {
  const std::ptrdiff_t width = picture.width;
  const std::uint8_t* p = picture.data + v * picture.row;
  std::int32_t* const first = green_blue.data() + kReach;
  std::int32_t* const second = red.data() + kReach;
  for (std::ptrdiff_t u = 0; u < width; ++u, p += picture.pixel) {
    const std::int32_t b = p[0];
    const std::int32_t g = p[picture.channel];
    const std::int32_t r = p[2 * picture.channel];
    first[u] = g - b;
    second[u] = 2 * r - g - b;
  }
  for (Row* row : {&green_blue, &red}) {
    std::fill_n(row->begin(), kReach, (*row)[kReach]);
    std::fill_n(row->end() - kReach, kReach, (*row)[kReach + width - 1]);
  }
}

void add(Row& sum, const Row& in, const Row& out) {
  const std::size_t n = sum.size();
  std::int32_t* const s = sum.data();
  const std::int32_t* const a = in.data();
  const std::int32_t* const b = out.data();
  for (std::size_t i = 0; i < n; ++i) {
    s[i] += a[i] - b[i];
  }
}

// Sums over kMeanPx neighbours: result[i] is that of values[i] to values[i + 4].
void five(const Row& values, Row& sums) {
  const std::size_t n = values.size() - kMeanPx + 1;
  const std::int32_t* const v = values.data();
  std::int32_t* const s = sums.data();
  for (std::size_t i = 0; i < n; ++i) {
    s[i] = v[i] + v[i + 1] + v[i + 2] + v[i + 3] + v[i + 4];
  }
}

static_assert(kMeanPx == 5 && kAboutPx == 15, "sums of five, and three of these");

// Mean near less mean about, in DN of one chroma of scale `unit`.
void contrast(const Sums& sums, Row& near, Row& about, float unit, std::vector<float>& out) {
  five(sums.near, near);
  five(sums.about, about);
  const float own = unit / (kMeanPx * kMeanPx);
  const float wide = unit / (kAboutPx * kAboutPx);
  const std::int32_t* const a = near.data() + kReach - kNear;
  const std::int32_t* const b = about.data();
  const std::size_t n = out.size();
  float* const o = out.data();
  for (std::size_t i = 0; i < n; ++i) {
    o[i] = own * static_cast<float>(a[i]) -
           wide * static_cast<float>(b[i] + b[i + kMeanPx] + b[i + 2 * kMeanPx]);
  }
}

}  // namespace

Rise rise(const Picture& picture, const std::array<Vec2, 2>& hues) {
  const int width = static_cast<int>(picture.width);
  const int height = static_cast<int>(picture.height);
  const std::size_t cells = static_cast<std::size_t>(width) * height;
  Rise found{
      width, height, {std::vector<float>(cells), std::vector<float>(cells)}, std::vector<float>(cells)};
  const std::size_t padded = width + 2 * kReach;
  // The last kAboutPx + 1 rows in a ring: the one that leaves is there while the new one comes.
  constexpr int kRing = kAboutPx + 1;
  std::array<std::array<Row, 2>, kRing> ring;
  for (auto& rows : ring) {
    rows = {Row(padded), Row(padded)};
  }
  const auto slot = [](int v) { return (v + 2 * kRing) % kRing; };
  const auto load = [&](int v) {
    auto& [first, second] = ring[slot(v)];
    chroma_row(picture, std::clamp(v, 0, height - 1), first, second);
  };
  std::array<Sums, 2> sums;
  for (int k = 0; k < 2; ++k) {
    sums[k] = {Row(padded, 0), Row(padded, 0)};
  }
  const Row zero(padded, 0);
  for (int v = -kReach; v <= kReach; ++v) {
    load(v);
    for (int k = 0; k < 2; ++k) {
      add(sums[k].about, ring[slot(v)][k], zero);
      if (std::abs(v) <= kNear) {
        add(sums[k].near, ring[slot(v)][k], zero);
      }
    }
  }
  Row near(padded);
  Row about(padded);
  std::vector<float> first(width);
  std::vector<float> second(width);
  const auto unit1 = static_cast<float>(std::sqrt(0.5));
  const auto unit2 = static_cast<float>(std::sqrt(1.0 / 6.0));
  const std::array<float, 2> h0 = {static_cast<float>(hues[0].x), static_cast<float>(hues[0].y)};
  const std::array<float, 2> h1 = {static_cast<float>(hues[1].x), static_cast<float>(hues[1].y)};
  for (int v = 0; v < height; ++v) {
    if (v > 0) {
      load(v + kReach);
      for (int k = 0; k < 2; ++k) {
        add(sums[k].about, ring[slot(v + kReach)][k], ring[slot(v - kReach - 1)][k]);
        add(sums[k].near, ring[slot(v + kNear)][k], ring[slot(v - kNear - 1)][k]);
      }
    }
    contrast(sums[0], near, about, unit1, first);
    contrast(sums[1], near, about, unit2, second);
    float* const a = &found.along[0][static_cast<std::size_t>(v) * width];
    float* const b = &found.along[1][static_cast<std::size_t>(v) * width];
    float* const l = &found.length2[static_cast<std::size_t>(v) * width];
    for (int u = 0; u < width; ++u) {
      a[u] = h0[0] * first[u] + h0[1] * second[u];
      b[u] = h1[0] * first[u] + h1[1] * second[u];
      l[u] = first[u] * first[u] + second[u] * second[u];
    }
  }
  return found;
}

}  // namespace vision
