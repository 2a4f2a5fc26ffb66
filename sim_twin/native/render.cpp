// The frame: background drawn once, the robot drawn over it by ray casting, sensor noise last.
#include "render.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "render_ids.hpp"

namespace camera {
namespace {

constexpr int SETS = 64, PER_SET = 24, SAMPLES_PLAIN = 8, SAMPLES_BACKGROUND = 8;
constexpr int SLOTS = 8;
constexpr int BANK = 1 << 18;
constexpr float NORMAL_STEPS = 6000.0f;  // of one standard deviation; 5.4 of them fit
constexpr float DN_STEPS = 64.0f;
constexpr float DN_MAX = 320.0f, SIGMA_MAX_DN = 30.0f;  // so that level plus noise fits 16 bits
constexpr uint8_t EDGE = 1, EDGE_SIDES = 2, EDGE_MARK = 4;

// Counter-based: the value depends on the arguments alone (splitmix64).
uint64_t hash(uint64_t a, uint64_t b, uint64_t c) {
    uint64_t z = a + 0x9e3779b97f4a7c15ull * (b + 1) + 0xd1b54a32d192ed03ull * (c + 1);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
}

double unit(uint64_t bits) { return (static_cast<double>(bits >> 11) + 0.5) * 0x1p-53; }

// Antiderivative of the normal distribution function.
double ramp(double z) {
    return z * 0.5 * std::erfc(-z * M_SQRT1_2) + std::exp(-0.5 * z * z) / std::sqrt(2.0 * M_PI);
}

// Inverse distribution of one pixel's width blurred by a normal of `sigma` px.
double pixel_offset(double p, double sigma) {
    if (sigma < 1e-3) return p - 0.5;
    double lo = -0.5 - 6.0 * sigma, hi = -lo;
    for (int i = 0; i < 40; ++i) {
        const double x = 0.5 * (lo + hi);
        (sigma * (ramp((x + 0.5) / sigma) - ramp((x - 0.5) / sigma)) < p ? lo : hi) = x;
    }
    return 0.5 * (lo + hi);
}

}  // namespace

Renderer::Renderer(const View& view, const Scene& scene, const Robot& robot, uint64_t seed)
    : view_(view), scene_(scene), robot_(robot), seed_(seed) {
    const size_t pixels = static_cast<size_t>(view.width) * view.height;
    sight_.resize(pixels);
    for (int v = 0; v < view.height; ++v)
        for (int u = 0; u < view.width; ++u)
            sight_[static_cast<size_t>(v) * view.width + u] = line_of_sight(view, u, v);
    const double spread = std::sqrt(1.0 / 12.0 + scene.blur * scene.blur);
    reach_ = static_cast<int>(std::ceil(2.6 * spread));
    colour_of_id_ = {{}, robot.side, robot.tyre, robot.hub, robot.plate, {0.85f, 0.85f, 0.85f},
                     {0.04f, 0.04f, 0.04f}};
    mark_id_.assign(ID_PATCH, false);
    mark_id_[ID_TAG_WHITE] = mark_id_[ID_TAG_BLACK] = true;
    for (const Patch& patch : robot.patches) {
        colour_of_id_.push_back(patch.colour);
        mark_id_.push_back(patch.mark);
    }
    robot_radius_ = std::hypot(std::max(robot.half_length, robot.half_base + robot.wheel_radius),
                               std::max(robot.half_width, robot.half_track + robot.wheel_half_width));
    robot_height_ = robot.top;
    for (const Bar& bar : scene.bars) {
        colour_of_id_.push_back(bar.colour);
        mark_id_.push_back(false);
        if (!bar.body) continue;
        robot_radius_ = std::max({robot_radius_, std::hypot(bar.x0, bar.y0) + bar.half_width,
                                  std::hypot(bar.x1, bar.y1) + bar.half_width});
        robot_height_ = std::max(robot_height_, bar.z);
    }
    sample_table();
    noise_bank();
    background();
}

void Renderer::sample_table() {
    // Additive recurrence in three dimensions (generalised golden ratio): even for any count.
    constexpr double phi = 1.2207440846057596;
    for (int set = 0; set < SETS; ++set) {
        double shift[3];
        for (int d = 0; d < 3; ++d) shift[d] = unit(hash(0x5e7, set, d));
        for (int i = 0; i < PER_SET; ++i) {
            double p[3], power = 1.0;
            for (double& x : p) {
                power *= phi;
                x = std::fmod(shift[&x - p] + i / power, 1.0);
            }
            samples_.push_back({static_cast<float>(pixel_offset(p[0], scene_.blur)),
                                static_cast<float>(pixel_offset(p[1], scene_.blur)),
                                static_cast<int>(p[2] * SLOTS)});
        }
    }
}

void Renderer::noise_bank() {
    normal_.resize(BANK + 3 * static_cast<size_t>(view_.width));
    for (size_t i = 0; i < normal_.size(); ++i) {
        const double radius = std::sqrt(-2.0 * std::log(unit(hash(seed_, i, 1))));
        const double x = radius * std::cos(2.0 * M_PI * unit(hash(seed_, i, 2)));
        normal_[i] = static_cast<int16_t>(std::clamp(x * NORMAL_STEPS, -32767.0, 32767.0));
    }
    const float read2 = scene_.read_noise * scene_.read_noise;
    for (int dn = 0; dn <= static_cast<int>(DN_MAX); ++dn) {
        const float sigma = std::sqrt(read2 + scene_.dn_per_electron * static_cast<float>(dn));
        sigma_of_dn_.push_back(static_cast<int16_t>(
            std::min(sigma, SIGMA_MAX_DN) * (DN_STEPS * 65536.0f / NORMAL_STEPS)));
    }
}

Sight Renderer::sight_at(int u, int v, float du, float dv) const {
    const int width = view_.width;
    const size_t at = static_cast<size_t>(v) * width + u;
    const Sight& s = sight_[at];
    // Linear within the pixel: the lean curves by 1e-6 per px^2, 2 um on the floor.
    const Sight& right = u + 1 < width ? sight_[at + 1] : sight_[at - 1];
    const Sight& down = v + 1 < view_.height ? sight_[at + width] : sight_[at - width];
    const float a = u + 1 < width ? du : -du, b = v + 1 < view_.height ? dv : -dv;
    return {s.x + (right.x - s.x) * a + (down.x - s.x) * b,
            s.y + (right.y - s.y) * a + (down.y - s.y) * b,
            s.lx + (right.lx - s.lx) * a + (down.lx - s.lx) * b,
            s.ly + (right.ly - s.ly) * a + (down.ly - s.ly) * b};
}

void Renderer::background() {
    const size_t pixels = sight_.size();
    static_dn_.resize(3 * pixels);
    for (int v = 0; v < view_.height; ++v)
        for (int u = 0; u < view_.width; ++u) {
            const size_t at = static_cast<size_t>(v) * view_.width + u;
            const Sample* samples = &samples_[hash(1, u, v) % SETS * PER_SET];
            float sum[3] = {0, 0, 0};
            for (int i = 0; i < SAMPLES_BACKGROUND; ++i) {
                const Colour c = floor_sample(sight_at(u, v, samples[i].du, samples[i].dv));
                for (int k = 0; k < 3; ++k) sum[k] += c[k];
            }
            for (int k = 0; k < 3; ++k)
                static_dn_[3 * at + k] =
                    scene_.white_balance[k] *
                    (sum[k] / SAMPLES_BACKGROUND * scene_.light[at] + scene_.glare[at]);
        }
    level_.resize(3 * pixels);
    sigma_.resize(3 * pixels);
    quantise(static_dn_.data(), static_cast<int>(3 * pixels), level_.data(), sigma_.data());
}

Renderer::Window Renderer::window() const {
    double lo_u = 1e9, lo_v = 1e9, hi_u = -1e9, hi_v = -1e9;
    const double lamp = std::max(std::fabs(scene_.lamp_x), std::fabs(scene_.lamp_y));
    for (const Pose& pose : {slots_.front(), slots_.back()})
        for (int level = 0; level < 2; ++level)
            for (int i = 0; i < 16; ++i) {
                const double reach =
                    1.02 * robot_radius_ + (level ? 0.0 : SHADE_REACH_M + lamp * robot_.top);
                const double angle = M_PI / 8.0 * i;
                double u, v;
                if (!project(view_, pose.x + reach * std::cos(angle),
                             pose.y + reach * std::sin(angle), level * robot_height_, u, v))
                    return {0, 0, view_.width, view_.height};
                lo_u = std::min(lo_u, u);
                hi_u = std::max(hi_u, u);
                lo_v = std::min(lo_v, v);
                hi_v = std::max(hi_v, v);
            }
    const auto bound = [this](double p, int top) {
        return static_cast<int>(std::clamp(p, 0.0, static_cast<double>(top)));
    };
    return {bound(lo_u - reach_, view_.width), bound(lo_v - reach_, view_.height),
            bound(hi_u + reach_ + 2, view_.width), bound(hi_v + reach_ + 2, view_.height)};
}

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
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            const Sight& s = sight_[static_cast<size_t>(w.v0 + j) * view_.width + w.u0 + i];
            const size_t at = static_cast<size_t>(j) * columns + i;
            id_first_[at] = trace(s, first);
            id_last_[at] = still ? id_first_[at] : trace(s, last);
        }
    const auto in_plane = [this](uint8_t id) {
        return id >= ID_PLATE && id < ID_PATCH + robot_.patches.size();
    };
    const auto mark_edge = [&](size_t a, uint8_t id_a, size_t b, uint8_t id_b) {
        if (id_a == id_b) return;
        const uint8_t flag = EDGE | (in_plane(id_a) && in_plane(id_b) ? 0 : EDGE_SIDES) |
                             (mark_id_[id_a] || mark_id_[id_b] ? EDGE_MARK : 0);
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
                flags_row_[static_cast<size_t>(j) * columns + i] |=
                    flags_[static_cast<size_t>(j) * columns + i + d];
    flags_.assign(count, 0);
    for (int j = 0; j < rows; ++j)
        for (int d = std::max(-reach_ + 1, -j); d < std::min(reach_, rows - j); ++d)
            for (int i = 0; i < columns; ++i)
                flags_[static_cast<size_t>(j) * columns + i] |=
                    flags_row_[static_cast<size_t>(j + d) * columns + i];
}

void Renderer::composite_pixel(int u, int v, uint8_t flags, uint8_t id, float* dn) const {
    const size_t at = static_cast<size_t>(v) * view_.width + u;
    float sum[3] = {0, 0, 0};
    int floor = 0, count = 1;
    if (!(flags & EDGE)) {
        floor = id == ID_FLOOR;
        for (int k = 0; k < 3; ++k) sum[k] = colour_of_id_[id][k];
    } else {
        const Sample* samples = &samples_[hash(2, u, v) % SETS * PER_SET];
        count = flags & EDGE_MARK ? PER_SET : SAMPLES_PLAIN;
        for (int i = 0; i < count; ++i) {
            const Sight s = sight_at(u, v, samples[i].du, samples[i].dv);
            const Pose& p = slots_[samples[i].slot];
            uint8_t hit;
            if (flags & EDGE_SIDES) {
                hit = trace(s, p);
            } else {
                const float x = s.x + s.lx * robot_.top - p.x, y = s.y + s.ly * robot_.top - p.y;
                hit = trace_top(p.c * x + p.s * y, p.c * y - p.s * x);
            }
            floor += hit == ID_FLOOR;
            for (int k = 0; k < 3; ++k) sum[k] += colour_of_id_[hit][k];
        }
    }
    const float share = 1.0f / static_cast<float>(count);
    const float floor_share = static_cast<float>(floor) * share;
    const float shade = floor > 0 ? shade_at(u, v) : 1.0f;
    for (int k = 0; k < 3; ++k) {
        const float glare = scene_.white_balance[k] * scene_.glare[at];
        const float floor_dn = static_dn_[3 * at + k] - glare;
        dn[k] = glare + floor_share * shade * floor_dn +
                share * sum[k] * scene_.light[at] * scene_.white_balance[k];
    }
}

void Renderer::composite(const Window& w) {
    const int columns = w.u1 - w.u0, rows = w.v1 - w.v0;
    const size_t count = 3 * static_cast<size_t>(columns) * rows;
    dn_.resize(count);
    window_level_.resize(count);
    window_sigma_.resize(count);
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            const size_t at = static_cast<size_t>(j) * columns + i;
            composite_pixel(w.u0 + i, w.v0 + j, flags_[at], id_first_[at], &dn_[3 * at]);
        }
    quantise(dn_.data(), static_cast<int>(count), window_level_.data(), window_sigma_.data());
}

void Renderer::quantise(const float* dn, int count, int16_t* level, int16_t* sigma) const {
    for (int i = 0; i < count; ++i) {
        const float value = std::clamp(dn[i], 0.0f, DN_MAX - 1.0f);
        level[i] = static_cast<int16_t>(value * DN_STEPS + 0.5f);
        sigma[i] = sigma_of_dn_[static_cast<int>(value + 0.5f)];
    }
}

void Renderer::emit(const int16_t* level, const int16_t* sigma, const int16_t* normal, int count,
                    uint8_t* out) const {
    constexpr int16_t half = static_cast<int16_t>(DN_STEPS / 2);
    for (int i = 0; i < count; ++i) {
        const int16_t noise = static_cast<int16_t>((sigma[i] * normal[i]) >> 16);
        const int16_t dn = static_cast<int16_t>(static_cast<int16_t>(level[i] + noise + half) >> 6);
        out[i] = static_cast<uint8_t>(std::clamp<int16_t>(dn, 0, 255));
    }
}

// The poses at the middle of each time slot of the exposure. They are rounded to a grid far below
// what the sensor can tell (0.003 px), so that a robot at rest is drawn once and only its noise anew.
std::vector<Pose> Renderer::slots_of(const std::vector<std::array<double, 3>>& poses) {
    constexpr double GRID[3] = {1e-5, 1e-5, 5e-5};  // m, m, rad
    std::vector<Pose> slots;
    for (int i = 0; i < SLOTS; ++i) {
        const double at = (i + 0.5) / SLOTS * static_cast<double>(poses.size() - 1);
        const size_t low = static_cast<size_t>(at), high = std::min(low + 1, poses.size() - 1);
        const double f = at - static_cast<double>(low);
        double p[3];
        for (int k = 0; k < 3; ++k) {
            p[k] = poses[low][k] + f * (poses[high][k] - poses[low][k]);
            p[k] = std::round(p[k] / GRID[k]) * GRID[k];
        }
        slots.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]),
                         static_cast<float>(std::cos(p[2])), static_cast<float>(std::sin(p[2]))});
    }
    return slots;
}

bool Renderer::same(const std::vector<Pose>& a, const std::vector<Pose>& b) {
    return a.size() == b.size() &&
           std::equal(a.begin(), a.end(), b.begin(), [](const Pose& p, const Pose& q) {
               return p.x == q.x && p.y == q.y && p.c == q.c && p.s == q.s;
           });
}

void Renderer::make(uint64_t index, const std::vector<std::array<double, 3>>& poses,
                    uint8_t* out) {
    Window w{0, 0, 0, 0};
    if (!poses.empty()) {
        const std::vector<Pose> drawn = slots_of(poses);
        if (!same(drawn, slots_)) {
            slots_ = drawn;
            drawn_window_ = window();
            if (drawn_window_.u1 > drawn_window_.u0 && drawn_window_.v1 > drawn_window_.v0) {
                classify(drawn_window_);
                composite(drawn_window_);
            }
        }
        w = drawn_window_;
    }
    const int width = view_.width;
    for (int v = 0; v < view_.height; ++v) {
        const int16_t* normal = &normal_[hash(seed_ + 7, index, v) % BANK];
        const size_t row = 3 * static_cast<size_t>(v) * width;
        const auto still = [&](int u0, int u1) {
            emit(&level_[row + 3 * u0], &sigma_[row + 3 * u0], normal + 3 * u0, 3 * (u1 - u0),
                 out + row + 3 * u0);
        };
        if (v < w.v0 || v >= w.v1 || w.u1 <= w.u0) {
            still(0, width);
            continue;
        }
        still(0, w.u0);
        const size_t in_window = 3 * static_cast<size_t>(v - w.v0) * (w.u1 - w.u0);
        emit(&window_level_[in_window], &window_sigma_[in_window], normal + 3 * w.u0,
             3 * (w.u1 - w.u0), out + row + 3 * w.u0);
        if (w.u1 < width) still(w.u1, width);
    }
}

}  // namespace camera
