// What a line of sight meets: robot, bars, things on the floor, the floor itself.
#include <algorithm>
#include <cmath>

#include "render.hpp"
#include "render_ids.hpp"
#include "render_wide.hpp"

namespace camera {
namespace {

// Narrows the heights [lo, hi] to those at which p + l z lies within +-half.
inline void clip(float p, float l, float half, float& lo, float& hi) {
  if (std::fabs(l) < 1e-6f) {
    if (std::fabs(p) > half) hi = lo - 1.0f;
    return;
  }
  const float inv = 1.0f / l, a = (-half - p) * inv, b = (half - p) * inv;
  lo = std::max(lo, std::min(a, b));
  hi = std::min(hi, std::max(a, b));
}

// True when the sight passes a box about (0, 0) from `bottom` to `top`; `z` is where it enters.
inline bool meets_box(const Sight& s, float half_x, float half_y, float bottom, float top, float& z) {
  float lo = bottom, hi = top;
  clip(s.x, s.lx, half_x, lo, hi);
  clip(s.y, s.ly, half_y, lo, hi);
  z = hi;
  return lo <= hi;
}

// True when the sight passes a wheel that rolls along x, standing on the floor about (0, 0).
inline bool meets_wheel(const Sight& s, float radius, float half_width, float& z, bool& on_hub) {
  const float a = s.lx * s.lx + 1.0f, b = s.x * s.lx - radius, disc = b * b - a * s.x * s.x;
  if (disc < 0.0f) return false;
  const float root = std::sqrt(disc);
  float lo = (-b - root) / a, hi = (-b + root) / a;
  const float tread = hi;
  clip(s.y, s.ly, half_width, lo, hi);
  z = hi;
  const float u = s.x + s.lx * z, w = z - radius;
  on_hub = hi < tread && u * u + w * w < 0.36f * radius * radius;
  return lo <= hi;
}

inline bool meets_bar(const Bar& bar, const Sight& s) {
  const float px = s.x + s.lx * bar.z - bar.x0, py = s.y + s.ly * bar.z - bar.y0;
  const float dx = bar.x1 - bar.x0, dy = bar.y1 - bar.y0;
  const float along = std::clamp((px * dx + py * dy) / (dx * dx + dy * dy), 0.0f, 1.0f);
  const float ex = px - along * dx, ey = py - along * dy;
  return ex * ex + ey * ey < bar.half_width * bar.half_width;
}

// As meets_box for a block anywhere on the floor; its sides are in half shade.
bool meets_block(const Block& block, const Sight& s, float& z, float& lit) {
  lit = 1.0f;
  const float c = block.c, n = block.s;
  const float x = s.x - block.x, y = s.y - block.y;
  const Sight local{c * x + n * y, c * y - n * x, c * s.lx + n * s.ly, c * s.ly - n * s.lx};
  if (block.disc) {
    const float u = local.x + local.lx * block.top, v = local.y + local.ly * block.top;
    z = block.top;
    return u * u + v * v < block.half_x * block.half_x;
  }
  const bool met = meets_box(local, block.half_x, block.half_y, 0.0f, block.top, z);
  if (z < block.top) lit = 0.55f;
  return met;
}

inline Sight in_body(const Sight& s, const Pose& p) {
  const float x = s.x - p.x, y = s.y - p.y;
  return {p.c * x + p.s * y, p.c * y - p.s * x, p.c * s.lx + p.s * s.ly, p.c * s.ly - p.s * s.lx};
}

}  // namespace

uint8_t Renderer::trace_top(float x, float y) const {
  const Grid& tag = robot_.tag;
  if (tag.cells > 0) {
    const float outer = tag.half + tag.margin, tx = x - tag.x, ty = y - tag.y;
    if (std::fabs(tx) < outer && std::fabs(ty) < outer) {
      if (std::fabs(tx) >= tag.half || std::fabs(ty) >= tag.half) return ID_TAG_WHITE;
      // The tag's own x axis (image right) lies along body x, its y axis (down) along -y.
      const float cells = static_cast<float>(tag.cells) / (2.0f * tag.half);
      const int column = std::min(static_cast<int>((tx + tag.half) * cells), tag.cells - 1);
      const int row = std::min(static_cast<int>((tag.half - ty) * cells), tag.cells - 1);
      return tag.white[row * tag.cells + column] ? ID_TAG_WHITE : ID_TAG_BLACK;
    }
  }
  for (size_t i = robot_.patches.size(); i-- > 0;) {
    const Patch& p = robot_.patches[i];
    const float dx = x - p.x, dy = y - p.y;
    const bool inside = p.disc ? dx * dx + dy * dy < p.half_x * p.half_x
                               : std::fabs(dx) < p.half_x && std::fabs(dy) < p.half_y;
    if (inside) return static_cast<uint8_t>(ID_PATCH + i);
  }
  return ID_PLATE;
}

uint8_t Renderer::trace_sides(const Sight& body) const {
  float best = -1.0f, z;
  uint8_t id = ID_FLOOR;
  if (meets_box(body, robot_.half_length, robot_.half_width, robot_.bottom, robot_.top, z)) {
    best = z;
    id = ID_SIDE;
  }
  for (int wheel = 0; wheel < 4; ++wheel) {
    const float xw = robot_.axle_x + (wheel & 1 ? robot_.half_base : -robot_.half_base);
    const float yw = wheel & 2 ? robot_.half_track : -robot_.half_track;
    const Sight local{body.x - xw, body.y - yw, body.lx, body.ly};
    const float r = robot_.wheel_radius;
    if (std::fabs(local.y + local.ly * r) > robot_.wheel_half_width + std::fabs(local.ly) * r ||
        std::fabs(local.x + local.lx * r) > r + std::fabs(local.lx) * r)
      continue;
    bool on_hub;
    if (meets_wheel(local, robot_.wheel_radius, robot_.wheel_half_width, z, on_hub) && z > best) {
      best = z;
      id = on_hub ? ID_HUB : ID_TYRE;
    }
  }
  return id;
}

uint8_t Renderer::trace(const Sight& world, const Pose& pose) const {
  const Sight body = in_body(world, pose);
  for (size_t i = 0; i < scene_.bars.size(); ++i)
    if (meets_bar(scene_.bars[i], scene_.bars[i].body ? body : world))
      return static_cast<uint8_t>(ID_PATCH + robot_.patches.size() + i);
  const float x = body.x + body.lx * robot_.top, y = body.y + body.ly * robot_.top;
  if (std::fabs(x) < robot_.half_length && std::fabs(y) < robot_.half_width) return trace_top(x, y);
  // Nothing but bars reaches farther than these at any height up to the top.
  const float reach_x =
      std::max(robot_.half_length, std::fabs(robot_.axle_x) + robot_.half_base + robot_.wheel_radius);
  const float reach_y = std::max(robot_.half_width, robot_.half_track + robot_.wheel_half_width);
  const float up = 0.5f * robot_.top;
  if (std::fabs(body.x + body.lx * up) > reach_x + std::fabs(body.lx) * up ||
      std::fabs(body.y + body.ly * up) > reach_y + std::fabs(body.ly) * up)
    return ID_FLOOR;
  return trace_sides(body);
}

// What each pixel of a window shows, and which are edges; next to the window's own edge that is not whole.
void Renderer::classify(const Window& w) {
  const int columns = w.u1 - w.u0, rows = w.v1 - w.v0;
  const size_t count = static_cast<size_t>(columns) * rows;
  id_first_.resize(count);
  id_last_.resize(count);
  flags_.assign(count, 0);
  const Pose &first = slots_.front(), &last = slots_.back();
  const bool still = std::fabs(first.x - last.x) + std::fabs(first.y - last.y) +
                         robot_radius_ * std::fabs(first.s - last.s) <
                     1e-4f;
  for (int j = 0; j < rows; ++j) {
    const Sight* sights = &sight_[static_cast<size_t>(w.v0 + j) * view_.width + w.u0];
    trace_row(sights, columns, first, &id_first_[static_cast<size_t>(j) * columns]);
    if (!still) trace_row(sights, columns, last, &id_last_[static_cast<size_t>(j) * columns]);
  }
  if (still) id_last_ = id_first_;
  const size_t ids = colour_of_id_.size();
  const auto mark_edge = [&](size_t a, uint8_t id_a, size_t b, uint8_t id_b) {
    if (id_a == id_b) return;
    const uint8_t flag = edge_of_ids_[id_a * ids + id_b];
    flags_[a] |= flag;
    flags_[b] |= flag;
  };
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const size_t at = static_cast<size_t>(j) * columns + i;
      mark_edge(at, id_first_[at], at, id_last_[at]);
      if (i + 1 < columns) {
        mark_edge(at, id_first_[at], at + 1, id_first_[at + 1]);
        mark_edge(at, id_last_[at], at + 1, id_last_[at + 1]);
      }
      if (j + 1 < rows) {
        mark_edge(at, id_first_[at], at + columns, id_first_[at + columns]);
        mark_edge(at, id_last_[at], at + columns, id_last_[at + columns]);
      }
    }
  // The blur carries an edge `reach_` px; spread the flags along rows, then columns.
  flags_row_.assign(count, 0);
  for (int j = 0; j < rows; ++j)
    for (int d = -reach_ + 1; d < reach_; ++d)
      for (int i = std::max(0, -d); i < std::min(columns, columns - d); ++i)
        flags_row_[static_cast<size_t>(j) * columns + i] |= flags_[static_cast<size_t>(j) * columns + i + d];
  flags_.assign(count, 0);
  for (int j = 0; j < rows; ++j)
    for (int d = std::max(-reach_ + 1, -j); d < std::min(reach_, rows - j); ++d)
      for (int i = 0; i < columns; ++i)
        flags_[static_cast<size_t>(j) * columns + i] |= flags_row_[static_cast<size_t>(j + d) * columns + i];
}

// What lines of sight meet, each by itself or all together.
void Renderer::trace_row(const Sight* sights, int count, const Pose& pose, uint8_t* ids) const {
  if (!from_above_) {
    for (int i = 0; i < count; ++i) ids[i] = trace(sights[i], pose);
    return;
  }
  meet_row(outline_, pose, sights, count, ids);
  for (int i = 0; i < count; ++i)
    if (ids[i] == ID_ASIDE) ids[i] = trace_sides(in_body(sights[i], pose));
}

void Renderer::trace_samples(int u, int v, int count, uint8_t flags, uint8_t* hits) const {
  const SightPatch patch = sight_patch(u, v);
  const size_t set = hash(2, u, v) % SETS;
  const Sample* samples = &samples_[set * PER_SET];
  const float top = robot_.top;
  if (from_above_) {
    meet_samples(outline_, patch, dated_[set], count, !(flags & EDGE_SIDES), hits);
    for (int i = 0; i < count; ++i)
      if (hits[i] == ID_ASIDE)
        hits[i] = trace_sides(in_body(patch.at(samples[i].du, samples[i].dv), slots_[samples[i].slot]));
    return;
  }
  for (int i = 0; i < count; ++i) {
    const Sight s = patch.at(samples[i].du, samples[i].dv);
    const Pose& p = slots_[samples[i].slot];
    if (flags & EDGE_SIDES) {
      hits[i] = trace(s, p);
    } else {
      const float x = s.x + s.lx * top - p.x, y = s.y + s.ly * top - p.y;
      hits[i] = trace_top(p.c * x + p.s * y, p.c * y - p.s * x);
    }
  }
}

void Renderer::shade_row(const Sight* floor, int count, float* shade) const {
  const float up = 0.5f * robot_.top;
  const Pose p = slots_[slots_.size() / 2];
  const float ox = scene_.lamp_x * up - p.x, oy = scene_.lamp_y * up - p.y;
  const float half_x = robot_.half_length, half_y = robot_.half_track + robot_.wheel_half_width;
  for (int i = 0; i < count; ++i) {
    const float x = floor[i].x + ox, y = floor[i].y + oy;
    const float dx = std::max(std::fabs(p.c * x + p.s * y) - half_x, 0.0f);
    const float dy = std::max(std::fabs(p.c * y - p.s * x) - half_y, 0.0f);
    const float t = std::max(1.0f - std::sqrt(dx * dx + dy * dy) / SHADE_REACH_M, 0.0f);
    shade[i] = 1.0f - scene_.shade * t * t * (3.0f - 2.0f * t);
  }
}

Colour Renderer::floor_sample(const Sight& s) const {
  for (const Bar& bar : scene_.bars)
    if (!bar.body && meets_bar(bar, s)) return bar.colour;
  float best = -1.0f, z, lit;
  Colour colour{};
  for (const Block& block : scene_.blocks)
    if (meets_block(block, s, z, lit) && z > best) {
      best = z;
      for (int c = 0; c < 3; ++c) colour[c] = block.colour[c] * lit;
    }
  if (best >= 0.0f) return colour;
  const int n = scene_.texture_size;
  const auto wrapped = [n](float p, int& i, float& f) {
    const float whole = std::floor(p);
    f = p - whole;
    i = static_cast<int>(whole - n * std::floor(whole / n)) % n;
  };
  int i, j;
  float fx, fy;
  wrapped(s.x / scene_.texture_step, i, fx);
  wrapped(s.y / scene_.texture_step, j, fy);
  const int i1 = (i + 1) % n, j1 = (j + 1) % n;
  const float* t = scene_.texture.data();
  const float near = t[j * n + i] * (1 - fx) + t[j * n + i1] * fx;
  const float far = t[j1 * n + i] * (1 - fx) + t[j1 * n + i1] * fx;
  const float factor = near * (1 - fy) + far * fy;
  for (int c = 0; c < 3; ++c) colour[c] = scene_.floor[c] * factor;
  return colour;
}

}  // namespace camera
