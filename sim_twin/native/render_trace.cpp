// What a line of sight meets: robot, bars, things on the floor, the floor itself.
#include <algorithm>
#include <cmath>

#include "render.hpp"
#include "render_ids.hpp"

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
inline bool meets_box(const Sight& s, float half_x, float half_y, float bottom, float top,
                      float& z) {
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
    const float c = std::cos(block.theta), n = std::sin(block.theta);
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
    return {p.c * x + p.s * y, p.c * y - p.s * x, p.c * s.lx + p.s * s.ly,
            p.c * s.ly - p.s * s.lx};
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
        const float xw = wheel & 1 ? robot_.half_base : -robot_.half_base;
        const float yw = wheel & 2 ? robot_.half_track : -robot_.half_track;
        const Sight local{body.x - xw, body.y - yw, body.lx, body.ly};
        bool on_hub;
        if (meets_wheel(local, robot_.wheel_radius, robot_.wheel_half_width, z, on_hub) &&
            z > best) {
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
    if (std::fabs(x) < robot_.half_length && std::fabs(y) < robot_.half_width)
        return trace_top(x, y);
    // Nothing of the robot reaches farther than this radius at any height up to its top.
    const float r2 = robot_radius_ * robot_radius_;
    const float mx = body.x + 0.5f * body.lx * robot_.top, my = body.y + 0.5f * body.ly * robot_.top;
    const float slack = 0.5f * robot_.top * (std::fabs(body.lx) + std::fabs(body.ly));
    if (mx * mx + my * my > r2 + slack * (slack + 2.0f * robot_radius_)) return ID_FLOOR;
    return trace_sides(body);
}

float Renderer::shade_at(int u, int v) const {
    const Sight& floor = sight_[static_cast<size_t>(v) * view_.width + u];
    const float up = 0.5f * robot_.top;
    const Sight towards{floor.x + scene_.lamp_x * up, floor.y + scene_.lamp_y * up, 0, 0};
    const Sight body = in_body(towards, slots_[slots_.size() / 2]);
    const float wide = robot_.half_track + robot_.wheel_half_width;
    const float dx = std::max(std::fabs(body.x) - robot_.half_length, 0.0f);
    const float dy = std::max(std::fabs(body.y) - wide, 0.0f);
    const float t = std::clamp(1.0f - std::sqrt(dx * dx + dy * dy) / SHADE_REACH_M, 0.0f, 1.0f);
    return 1.0f - scene_.shade * t * t * (3.0f - 2.0f * t);
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
