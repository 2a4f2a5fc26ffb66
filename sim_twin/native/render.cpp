// The frame: background drawn once, the robot drawn over it by ray casting, sensor noise last.
#include "render.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "render_ids.hpp"
#include "render_wide.hpp"

namespace camera {
namespace {

constexpr int SAMPLES_BACKGROUND = 8;
// An edge is sampled as its contrast deserves: of a mark, of others, between two shades of black.
constexpr int SAMPLES_MARK = PER_SET, SAMPLES_PLAIN = 8, SAMPLES_FAINT = 4;
constexpr int SLOTS = 8;
constexpr int BANK = 1 << 18;
constexpr float NORMAL_STEPS = 6000.0f;  // of one standard deviation; 5.4 of them fit
constexpr float DN_STEPS = 64.0f;
constexpr float DN_MAX = 319.0f, SIGMA_MAX_DN = 30.0f;  // so that level plus noise fits 16 bits

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

// Every pixel of a frame goes through these two.
CAMERA_WIDE void quantised(const float* dn, int count, float read2, float shot, int16_t* level,
                           int16_t* sigma) {
  for (int i = 0; i < count; ++i) {
    const float value = std::min(std::max(dn[i], 0.0f), DN_MAX);
    level[i] = static_cast<int16_t>(value * DN_STEPS + 0.5f);
    sigma[i] = static_cast<int16_t>(std::min(std::sqrt(read2 + shot * value), SIGMA_MAX_DN) *
                                    (DN_STEPS * 65536.0f / NORMAL_STEPS));
  }
}

CAMERA_WIDE void noisy(const int16_t* level, const int16_t* sigma, const int16_t* normal, int count,
                       uint8_t* out) {
  constexpr int16_t half = static_cast<int16_t>(DN_STEPS / 2);
  for (int i = 0; i < count; ++i) {
    const int16_t noise = static_cast<int16_t>((sigma[i] * normal[i]) >> 16);
    const int16_t dn = static_cast<int16_t>(static_cast<int16_t>(level[i] + noise + half) >> 6);
    out[i] = static_cast<uint8_t>(std::clamp<int16_t>(dn, 0, 255));
  }
}

}  // namespace

Window common(const Window& a, const Window& b) {
  return {std::max(a.u0, b.u0), std::max(a.v0, b.v0), std::min(a.u1, b.u1), std::min(a.v1, b.v1)};
}

Renderer::Renderer(const View& view, const Scene& scene, const Robot& robot, uint64_t seed)
    : view_(view), scene_(scene), robot_(robot), outline_(robot),
      from_above_(scene.bars.empty() && robot.tag.cells == 0), seed_(seed) {
  for (Block& block : scene_.blocks) {
    block.c = std::cos(block.theta);
    block.s = std::sin(block.theta);
  }
  const size_t pixels = static_cast<size_t>(view.width) * view.height;
  sight_.resize(pixels);
  for (int v = 0; v < view.height; ++v)
    for (int u = 0; u < view.width; ++u)
      sight_[static_cast<size_t>(v) * view.width + u] = line_of_sight(view, u, v);
  const double spread = std::sqrt(1.0 / 12.0 + scene.blur * scene.blur);
  reach_ = static_cast<int>(std::ceil(2.6 * spread));
  colour_of_id_ = {
      {}, robot.side, robot.tyre, robot.hub, robot.plate, {0.85f, 0.85f, 0.85f}, {0.04f, 0.04f, 0.04f}};
  mark_id_.assign(ID_PATCH, false);
  mark_id_[ID_TAG_WHITE] = mark_id_[ID_TAG_BLACK] = true;
  for (const Patch& patch : robot.patches) {
    colour_of_id_.push_back(patch.colour);
    mark_id_.push_back(patch.mark);
  }
  const float reach_x = std::fabs(robot.axle_x) + robot.half_base + robot.wheel_radius;
  robot_radius_ = std::hypot(std::max(robot.half_length, reach_x),
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
  edge_table();
  sample_table();
  noise_bank();
  background();
}

Renderer::Renderer(const Renderer& other, uint64_t seed) : Renderer(other) {
  seed_ = seed;
  slots_.clear();
  parts_.clear();
  noise_bank();
}

// What an edge between any two ids is.
void Renderer::edge_table() {
  constexpr float FAINT = 0.15f;  // reflectance, the three colours together: 10 DN each
  const auto in_plane = [this](size_t id) { return id >= ID_PLATE && id < ID_PATCH + robot_.patches.size(); };
  const size_t count = colour_of_id_.size();
  edge_of_ids_.assign(count * count, 0);
  for (size_t a = 0; a < count; ++a)
    for (size_t b = 0; b < count; ++b) {
      if (a == b) continue;
      float contrast = 0.0f;
      for (int k = 0; k < 3; ++k) contrast += std::fabs(colour_of_id_[a][k] - colour_of_id_[b][k]);
      edge_of_ids_[a * count + b] =
          static_cast<uint8_t>(EDGE | (in_plane(a) && in_plane(b) ? 0 : EDGE_SIDES) |
                               (mark_id_[a] || mark_id_[b] ? EDGE_MARK : 0) |
                               (a == ID_FLOOR || b == ID_FLOOR || contrast > FAINT ? EDGE_PLAIN : 0));
    }
}

void Renderer::sample_table() {
  // Additive recurrence in three dimensions (generalised golden ratio): even for any count. Each
  // sample has its mirror image in place and time, so that no pixel's samples lean to one side.
  constexpr double phi = 1.2207440846057596;
  for (int set = 0; set < SETS; ++set) {
    double shift[3];
    for (int d = 0; d < 3; ++d) shift[d] = unit(hash(0x5e7, set, d));
    for (int i = 0; i < PER_SET / 2; ++i) {
      double p[3], power = 1.0;
      for (double& x : p) {
        power *= phi;
        x = std::fmod(shift[&x - p] + i / power, 1.0);
      }
      const float du = static_cast<float>(pixel_offset(p[0], scene_.blur));
      const float dv = static_cast<float>(pixel_offset(p[1], scene_.blur));
      const int slot = static_cast<int>(p[2] * SLOTS);
      samples_.push_back({du, dv, slot});
      samples_.push_back({-du, -dv, SLOTS - 1 - slot});
    }
  }
}

void Renderer::date_samples() {
  dated_.resize(SETS);
  for (int set = 0; set < SETS; ++set)
    for (int i = 0; i < PER_SET; ++i) {
      const Sample& sample = samples_[static_cast<size_t>(set) * PER_SET + i];
      const Pose& pose = slots_[sample.slot];
      Samples& to = dated_[set];
      to.du[i] = sample.du;
      to.dv[i] = sample.dv;
      to.x[i] = pose.x;
      to.y[i] = pose.y;
      to.c[i] = pose.c;
      to.s[i] = pose.s;
    }
}

void Renderer::noise_bank() {
  normal_.resize(BANK + 3 * static_cast<size_t>(view_.width));
  for (size_t i = 0; i < normal_.size(); ++i) {
    const double radius = std::sqrt(-2.0 * std::log(unit(hash(seed_, i, 1))));
    const double x = radius * std::cos(2.0 * M_PI * unit(hash(seed_, i, 2)));
    normal_[i] = static_cast<int16_t>(std::clamp(x * NORMAL_STEPS, -32767.0, 32767.0));
  }
}

SightPatch Renderer::sight_patch(int u, int v) const {
  const auto at = [&](int i, int j) -> const Sight& {
    return sight_[static_cast<size_t>(j) * view_.width + i];
  };
  const auto slope = [](const Sight& a, const Sight& b) {
    return Sight{b.x - a.x, b.y - a.y, b.lx - a.lx, b.ly - a.ly};
  };
  const int i = std::min(u, view_.width - 2), j = std::min(v, view_.height - 2);
  return {at(u, v), slope(at(i, v), at(i + 1, v)), slope(at(u, j), at(u, j + 1))};
}

void Renderer::background() {
  const size_t pixels = sight_.size();
  for (Shared<float>* map : {&floor_dn_, &glare_dn_}) map->resize(3 * pixels);
  std::vector<float> both(3 * pixels);
  for (int v = 0; v < view_.height; ++v)
    for (int u = 0; u < view_.width; ++u) {
      const size_t at = static_cast<size_t>(v) * view_.width + u;
      const Sample* samples = &samples_[hash(1, u, v) % SETS * PER_SET];
      const SightPatch patch = sight_patch(u, v);
      float sum[3] = {0, 0, 0};
      for (int i = 0; i < SAMPLES_BACKGROUND; ++i) {
        const Colour c = floor_sample(patch.at(samples[i].du, samples[i].dv));
        for (int k = 0; k < 3; ++k) sum[k] += c[k];
      }
      for (int k = 0; k < 3; ++k) {
        const float gain = scene_.white_balance[k];
        floor_dn_[3 * at + k] = gain * sum[k] / SAMPLES_BACKGROUND * scene_.light[at];
        glare_dn_[3 * at + k] = gain * scene_.glare[at];
        both[3 * at + k] = floor_dn_[3 * at + k] + glare_dn_[3 * at + k];
      }
    }
  level_.resize(3 * pixels);
  sigma_.resize(3 * pixels);
  quantise(both.data(), static_cast<int>(3 * pixels), level_.data(), sigma_.data());
}

// The part of the image that the robot at its first and last pose can reach, grown by `reach_m` on
// the floor.
Window Renderer::window(double reach_m) const {
  double lo_u = 1e9, lo_v = 1e9, hi_u = -1e9, hi_v = -1e9;
  for (const Pose& pose : {slots_.front(), slots_.back()})
    for (int level = 0; level < 2; ++level)
      for (int i = 0; i < 16; ++i) {
        const double reach = 1.02 * robot_radius_ + (level ? 0.0 : reach_m);
        const double angle = M_PI / 8.0 * i;
        double u, v;
        if (!project(view_, pose.x + reach * std::cos(angle), pose.y + reach * std::sin(angle),
                     level * robot_height_, u, v))
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

// Finds what the robot hides and shades. Bars over the floor take no shade, so where there are any
// the whole shaded part is looked at pixel by pixel.
void Renderer::set_windows() {
  const double lamp = std::max(std::fabs(scene_.lamp_x), std::fabs(scene_.lamp_y));
  shaded_ = window(SHADE_REACH_M + lamp * robot_.top);
  const bool bars =
      std::any_of(scene_.bars.begin(), scene_.bars.end(), [](const Bar& bar) { return !bar.body; });
  const Window body = bars ? shaded_ : window(0.0);
  hidden_ = common(body, shaded_);
}

void Renderer::composite_pixel(int u, int v, uint8_t flags, uint8_t id, float shade, float* dn) const {
  const size_t at = static_cast<size_t>(v) * view_.width + u;
  float sum[3] = {0, 0, 0};
  int floor = 0, count = 1;
  if (flags & EDGE) {
    count = flags & EDGE_MARK ? SAMPLES_MARK : flags & EDGE_PLAIN ? SAMPLES_PLAIN : SAMPLES_FAINT;
    uint8_t hits[PER_SET];
    trace_samples(u, v, count, flags, hits);
    for (int i = 0; i < count; ++i) {
      floor += hits[i] == ID_FLOOR;
      for (int k = 0; k < 3; ++k) sum[k] += colour_of_id_[hits[i]][k];
    }
  } else {
    for (int k = 0; k < 3; ++k) sum[k] = colour_of_id_[id][k];
  }
  const float share = 1.0f / static_cast<float>(count);
  const float floor_share = static_cast<float>(floor) * share * shade;
  for (int k = 0; k < 3; ++k)
    dn[k] = glare_dn_[3 * at + k] + floor_share * floor_dn_[3 * at + k] +
            share * sum[k] * scene_.light[at] * scene_.white_balance[k];
}

Renderer::Part Renderer::composite(const Window& w) {
  // The blur carries an edge from outside the window into it.
  const Window body = common(w.grown(reach_), hidden_);
  const bool hides = !body.empty();
  if (hides) classify(body);
  const int columns = w.u1 - w.u0, rows = w.v1 - w.v0;
  const Window own = common(w, body);
  const size_t count = 3 * static_cast<size_t>(columns) * rows;
  dn_.resize(count);
  shade_.resize(columns);
  for (int v = w.v0; v < w.v1; ++v) {
    const size_t first = static_cast<size_t>(v) * view_.width + w.u0;
    float* dn = &dn_[3 * static_cast<size_t>(v - w.v0) * columns];
    const float *floor = &floor_dn_[3 * first], *glare = &glare_dn_[3 * first];
    shade_row(&sight_[first], columns, shade_.data());
    for (int i = 0; i < columns; ++i)
      for (int k = 0; k < 3; ++k) dn[3 * i + k] = glare[3 * i + k] + shade_[i] * floor[3 * i + k];
    if (!hides || v < own.v0 || v >= own.v1) continue;
    const size_t row = static_cast<size_t>(v - body.v0) * (body.u1 - body.u0);
    for (int u = own.u0; u < own.u1; ++u) {
      const uint8_t flags = flags_[row + u - body.u0], id = id_first_[row + u - body.u0];
      const int column = u - w.u0;
      if (flags || id != ID_FLOOR) composite_pixel(u, v, flags, id, shade_[column], dn + 3 * column);
    }
  }
  Part part;
  part.at = w;
  part.level.resize(count);
  part.sigma.resize(count);
  quantise(dn_.data(), static_cast<int>(count), part.level.data(), part.sigma.data());
  return part;
}

// A window's part of what the robot hides and shades, drawn only when it was not before.
const Renderer::Part& Renderer::part(const Window& wanted) {
  for (const Part& part : parts_)
    if (part.at.holds(wanted)) return part;
  if (parts_.size() == MOST_PARTS) parts_.erase(parts_.begin());
  parts_.push_back(composite(wanted));
  return parts_.back();
}

void Renderer::quantise(const float* dn, int count, int16_t* level, int16_t* sigma) const {
  quantised(dn, count, scene_.read_noise * scene_.read_noise, scene_.dn_per_electron, level, sigma);
}

void Renderer::emit(const int16_t* level, const int16_t* sigma, const int16_t* normal, int count,
                    uint8_t* out) const {
  noisy(level, sigma, normal, count, out);
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
    slots.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(std::cos(p[2])),
                     static_cast<float>(std::sin(p[2]))});
  }
  return slots;
}

bool Renderer::same(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](const Pose& p, const Pose& q) {
           return p.x == q.x && p.y == q.y && p.c == q.c && p.s == q.s;
         });
}

void Renderer::make(uint64_t index, const std::vector<std::array<double, 3>>& poses, uint8_t* out) {
  draw(index, poses, {0, 0, view_.width, view_.height}, out);
}

void Renderer::draw(uint64_t index, const std::vector<std::array<double, 3>>& poses, const Window& wanted,
                    uint8_t* out) {
  static const Part nothing;
  const Part* robot = &nothing;
  if (!poses.empty()) {
    const std::vector<Pose> drawn = slots_of(poses);
    if (!same(drawn, slots_)) {
      slots_ = drawn;
      date_samples();
      set_windows();
      parts_.clear();
    }
    const Window own = common(wanted, shaded_);
    if (!own.empty()) robot = &part(own);
  }
  const Window w = common(wanted, robot->at);
  for (int v = wanted.v0; v < wanted.v1; ++v) {
    const int16_t* normal = &normal_[hash(seed_ + 7, index, v) % BANK];
    const size_t row = 3 * static_cast<size_t>(v) * view_.width;
    const auto still = [&](int u0, int u1) {
      emit(&level_[row + 3 * u0], &sigma_[row + 3 * u0], normal + 3 * u0, 3 * (u1 - u0), out + row + 3 * u0);
    };
    if (v < w.v0 || v >= w.v1 || w.u1 <= w.u0) {
      still(wanted.u0, wanted.u1);
      continue;
    }
    if (wanted.u0 < w.u0) still(wanted.u0, w.u0);
    const size_t across = robot->at.u1 - robot->at.u0;
    const size_t in_part = 3 * (static_cast<size_t>(v - robot->at.v0) * across + (w.u0 - robot->at.u0));
    emit(&robot->level[in_part], &robot->sigma[in_part], normal + 3 * w.u0, 3 * (w.u1 - w.u0),
         out + row + 3 * w.u0);
    if (w.u1 < wanted.u1) still(w.u1, wanted.u1);
  }
}

}  // namespace camera
