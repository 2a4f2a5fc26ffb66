#include "render_wide.hpp"

#include <algorithm>
#include <cmath>

#include "render_ids.hpp"

#if defined(__GNUC__)
#define CAMERA_INLINE inline __attribute__((always_inline))
#else
#define CAMERA_INLINE inline
#endif

namespace camera {
namespace {

constexpr int CHUNK = 64;

// Lines of sight in the robot's axes: where they meet the floor, and their lean.
template <int N>
struct Lines {
  float x[N], y[N], lx[N], ly[N];
};

// Ids of `count` places on the plate: of what lies on it the last one counts.
template <int N>
CAMERA_INLINE void on_plate(const Patch* patches, size_t patch_count, const float (&x)[N],
                            const float (&y)[N], int count, int (&ids)[N]) {
  for (size_t k = 0; k < patch_count; ++k) {
    const Patch p = patches[k];
    const int id = ID_PATCH + static_cast<int>(k);
    if (p.disc) {
      const float most = p.half_x * p.half_x;
      for (int i = 0; i < count; ++i) {
        const float dx = x[i] - p.x, dy = y[i] - p.y;
        ids[i] = ((dx * dx + dy * dy < most) & (ids[i] >= ID_PLATE)) ? id : ids[i];
      }
    } else {
      for (int i = 0; i < count; ++i) {
        const float dx = std::fabs(x[i] - p.x), dy = std::fabs(y[i] - p.y);
        ids[i] = ((dx < p.half_x) & (dy < p.half_y) & (ids[i] >= ID_PLATE)) ? id : ids[i];
      }
    }
  }
}

// Ids of lines of sight: negative for those that need the sides.
template <int N>
CAMERA_INLINE void from_above(const Outline& robot, const Lines<N>& at, int count, int (&ids)[N]) {
  float x[N], y[N];
  const float top = robot.top, up = 0.5f * robot.top;
  const float half_length = robot.half_length, half_width = robot.half_width;
  const float reach_x = robot.reach_x, reach_y = robot.reach_y;
  for (int i = 0; i < count; ++i) {
    x[i] = at.x[i] + at.lx[i] * top;
    y[i] = at.y[i] + at.ly[i] * top;
    const bool plate = (std::fabs(x[i]) < half_length) & (std::fabs(y[i]) < half_width);
    const bool beyond = (std::fabs(at.x[i] + at.lx[i] * up) > reach_x + std::fabs(at.lx[i]) * up) |
                        (std::fabs(at.y[i] + at.ly[i] * up) > reach_y + std::fabs(at.ly[i]) * up);
    const int rest = beyond ? ID_FLOOR : -1;
    ids[i] = plate ? ID_PLATE : rest;
  }
  on_plate(robot.patches.data(), robot.patches.size(), x, y, count, ids);
}

template <int N>
CAMERA_INLINE void samples_of(const Outline& robot, const SightPatch& patch, const Samples& s, bool in_plane,
                              uint8_t* out) {
  int ids[N];
  Lines<N> at;
  const Sight middle = patch.middle, per_u = patch.per_u, per_v = patch.per_v;
  if (in_plane) {
    const float top = robot.top;
    for (int i = 0; i < N; ++i) {
      const float sx = middle.x + per_u.x * s.du[i] + per_v.x * s.dv[i];
      const float sy = middle.y + per_u.y * s.du[i] + per_v.y * s.dv[i];
      const float lx = middle.lx + per_u.lx * s.du[i] + per_v.lx * s.dv[i];
      const float ly = middle.ly + per_u.ly * s.du[i] + per_v.ly * s.dv[i];
      const float x = sx + lx * top - s.x[i], y = sy + ly * top - s.y[i];
      at.x[i] = s.c[i] * x + s.s[i] * y;
      at.y[i] = s.c[i] * y - s.s[i] * x;
      ids[i] = ID_PLATE;
    }
    on_plate(robot.patches.data(), robot.patches.size(), at.x, at.y, N, ids);
  } else {
    for (int i = 0; i < N; ++i) {
      const float x = middle.x + per_u.x * s.du[i] + per_v.x * s.dv[i] - s.x[i];
      const float y = middle.y + per_u.y * s.du[i] + per_v.y * s.dv[i] - s.y[i];
      const float lx = middle.lx + per_u.lx * s.du[i] + per_v.lx * s.dv[i];
      const float ly = middle.ly + per_u.ly * s.du[i] + per_v.ly * s.dv[i];
      at.x[i] = s.c[i] * x + s.s[i] * y;
      at.y[i] = s.c[i] * y - s.s[i] * x;
      at.lx[i] = s.c[i] * lx + s.s[i] * ly;
      at.ly[i] = s.c[i] * ly - s.s[i] * lx;
    }
    from_above(robot, at, N, ids);
  }
  for (int i = 0; i < N; ++i) out[i] = static_cast<uint8_t>(ids[i]);
}

CAMERA_WIDE void chunk_of(const Outline& robot, const Pose& pose, const Sight* sights, int count,
                          uint8_t* out) {
  Lines<CHUNK> at;
  int ids[CHUNK];
  const Pose p = pose;
  for (int i = 0; i < count; ++i) {
    const float x = sights[i].x - p.x, y = sights[i].y - p.y, lx = sights[i].lx, ly = sights[i].ly;
    at.x[i] = p.c * x + p.s * y;
    at.y[i] = p.c * y - p.s * x;
    at.lx[i] = p.c * lx + p.s * ly;
    at.ly[i] = p.c * ly - p.s * lx;
  }
  from_above(robot, at, count, ids);
  for (int i = 0; i < count; ++i) out[i] = static_cast<uint8_t>(ids[i]);
}

CAMERA_WIDE void all_samples(const Outline& robot, const SightPatch& patch, const Samples& s, bool in_plane,
                             uint8_t* out) {
  samples_of<PER_SET>(robot, patch, s, in_plane, out);
}

CAMERA_WIDE void first_samples(const Outline& robot, const SightPatch& patch, const Samples& s, bool in_plane,
                               uint8_t* out) {
  samples_of<8>(robot, patch, s, in_plane, out);
}

}  // namespace

Outline::Outline(const Robot& robot)
    : top(robot.top), half_length(robot.half_length), half_width(robot.half_width),
      reach_x(std::max(robot.half_length, std::fabs(robot.axle_x) + robot.half_base + robot.wheel_radius)),
      reach_y(std::max(robot.half_width, robot.half_track + robot.wheel_half_width)), patches(robot.patches) {
}

void meet_row(const Outline& robot, const Pose& pose, const Sight* sights, int count, uint8_t* ids) {
  for (int first = 0; first < count; first += CHUNK)
    chunk_of(robot, pose, sights + first, std::min(CHUNK, count - first), ids + first);
}

void meet_samples(const Outline& robot, const SightPatch& patch, const Samples& samples, int count,
                  bool in_plane, uint8_t* ids) {
  if (count > 8) {
    all_samples(robot, patch, samples, in_plane, ids);
  } else {
    first_samples(robot, patch, samples, in_plane, ids);
  }
}

}  // namespace camera
