// The camera of the twin: a linear 8-bit sensor behind a distorted lens at a known pose.
//
// Frames: world X right, Y up on the floor, z up, metres; body x forward, y left; camera axes as
// OpenCV has them. R and t take camera coordinates to the world. DN is the sensor's 8-bit step.
// Nothing here is shared with the localiser: lens and plane geometry are written a second time, so
// that an error in either shows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace camera {

// Numbers worked out once; a copy has the same ones, not its own. Not to be written after the first copy.
template <class T>
class Shared {
 public:
  Shared() = default;
  Shared(std::vector<T> values) : values_(std::make_shared<std::vector<T>>(std::move(values))) {}
  void resize(size_t count) { values_->resize(count); }
  size_t size() const { return values_->size(); }
  T* data() const { return values_->data(); }
  T& operator[](size_t i) const { return (*values_)[i]; }

 private:
  std::shared_ptr<std::vector<T>> values_ = std::make_shared<std::vector<T>>();
};

using Colour = std::array<float, 3>;  // reflectance: blue, green, red

struct View {
  int width = 0, height = 0;              // px
  double fx = 0, fy = 0, cx = 0, cy = 0;  // px
  std::array<double, 5> dist{};           // k1 k2 p1 p2 k3
  std::array<double, 3> below{};          // k4 k5 k6 of a rational lens, 0 for none
  bool fisheye = false;                   // radial terms of the angle from the axis
  std::array<double, 9> R{};              // camera to world, by rows
  std::array<double, 3> t{};              // camera centre, m
};

// A disc (radius half_x) or rectangle on the plate, body frame, m.
struct Patch {
  bool disc = false, mark = false;
  float x = 0, y = 0, half_x = 0, half_y = 0;
  Colour colour{};
};

// A square grid of black and white cells on the plate (ArUco), rows from body +x down, m.
struct Grid {
  int cells = 0;  // per side, 0 for none
  float x = 0, y = 0, half = 0, margin = 0;
  std::vector<uint8_t> white;
};

// Upright box, or flat disc when `disc` (radius half_x at height top), world frame, m.
struct Block {
  bool disc = false;
  float x = 0, y = 0, half_x = 0, half_y = 0, theta = 0, top = 0;
  Colour colour{};
  float c = 1, s = 0;  // of theta, set by the renderer
};

// Straight flat bar above the robot, m; ends in the world or in the body frame.
struct Bar {
  bool body = false;
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0, half_width = 0, z = 0;
  Colour colour{};
};

struct Robot {
  float half_length = 0, half_width = 0, bottom = 0, top = 0;                   // body box, m
  float wheel_radius = 0, wheel_half_width = 0, half_track = 0, half_base = 0;  // m
  float axle_x = 0;                                                             // middle of the axles, m
  Colour plate{}, side{}, tyre{}, hub{};
  std::vector<Patch> patches;  // the last one drawn lies on top
  Grid tag;
};

struct Scene {
  Shared<float> texture;   // floor reflectance factor, periodic, by rows
  int texture_size = 0;    // px per side
  float texture_step = 0;  // m per px
  Colour floor{};
  std::vector<Block> blocks;
  std::vector<Bar> bars;
  Shared<float> light;  // DN of a white surface, per pixel
  Shared<float> glare;  // DN added, per pixel
  Colour white_balance{};
  float blur = 0;                             // px RMS
  float read_noise = 0, dn_per_electron = 0;  // DN
  float lamp_x = 0, lamp_y = 0, shade = 0;    // lean towards the lamp; share of light taken
};

struct Pose {
  float x = 0, y = 0, c = 1, s = 0;
};

// A line of sight as the point where it meets the floor and its lean d(x, y)/dz.
struct Sight {
  float x = 0, y = 0, lx = 0, ly = 0;
};

// Lines of sight within one pixel: linear, as the lean curves by 1e-6 per px^2, 2 um on the floor.
struct SightPatch {
  Sight middle, per_u, per_v;
  Sight at(float du, float dv) const {
    return {middle.x + per_u.x * du + per_v.x * dv, middle.y + per_u.y * du + per_v.y * dv,
            middle.lx + per_u.lx * du + per_v.lx * dv, middle.ly + per_u.ly * du + per_v.ly * dv};
  }
};

// Where in its pixel and when in the exposure one sample is taken.
struct Sample {
  float du = 0, dv = 0;
  int slot = 0;
};

constexpr int PER_SET = 24;  // samples of a pixel, at most

// The same for all samples of a pixel, with the robot's poses then.
struct Samples {
  std::array<float, PER_SET> du, dv, x, y, c, s;
};

// The robot seen from above: its plate with what lies on it, and how far anything of it reaches. No bars, no tag.
struct Outline {
  float top, half_length, half_width, reach_x, reach_y;
  std::vector<Patch> patches;

  explicit Outline(const Robot& robot);
};

// Columns u0 to u1 - 1 of rows v0 to v1 - 1.
struct Window {
  int u0, v0, u1, v1;

  bool empty() const { return u1 <= u0 || v1 <= v0; }
  bool holds(const Window& w) const {
    return w.empty() || (u0 <= w.u0 && v0 <= w.v0 && u1 >= w.u1 && v1 >= w.v1);
  }
  Window grown(int by) const { return {u0 - by, v0 - by, u1 + by, v1 + by}; }
};
Window common(const Window& a, const Window& b);

class Renderer {
 public:
  Renderer(const View& view, const Scene& scene, const Robot& robot, uint64_t seed);
  // The same scene with other noise: nothing but the noise is worked out anew.
  Renderer(const Renderer& other, uint64_t seed);

  // Writes the frame `index`, (height, width, 3); poses are (x, y, theta), evenly spaced from
  // the start to the end of the exposure.
  void make(uint64_t index, const std::vector<std::array<double, 3>>& poses, uint8_t* out);
  // Writes only the pixels of a window of that frame, the same ones, where they are in the whole.
  void draw(uint64_t index, const std::vector<std::array<double, 3>>& poses, const Window& wanted,
            uint8_t* out);

 private:
  // What the robot at the poses in `slots_` hides and shades of a window, before noise.
  struct Part {
    Window at{0, 0, 0, 0};
    std::vector<int16_t> level, sigma;
  };
  static constexpr size_t MOST_PARTS = 4;
  void background();
  void edge_table();
  void noise_bank();
  void sample_table();
  Colour floor_sample(const Sight& sight) const;
  SightPatch sight_patch(int u, int v) const;
  static std::vector<Pose> slots_of(const std::vector<std::array<double, 3>>& poses);
  static bool same(const std::vector<Pose>& a, const std::vector<Pose>& b);
  Window window(double reach_m) const;
  void set_windows();
  const Part& part(const Window& wanted);
  Part composite(const Window& w);
  void classify(const Window& w);
  void composite_pixel(int u, int v, uint8_t flags, uint8_t id, float shade, float* dn) const;
  void trace_samples(int u, int v, int count, uint8_t flags, uint8_t* hits) const;
  void trace_row(const Sight* sights, int count, const Pose& pose, uint8_t* ids) const;
  void date_samples();
  uint8_t trace(const Sight& world, const Pose& pose) const;
  uint8_t trace_top(float x, float y) const;
  uint8_t trace_sides(const Sight& body) const;
  void shade_row(const Sight* floor, int count, float* shade) const;
  void quantise(const float* dn, int count, int16_t* level, int16_t* sigma) const;
  void emit(const int16_t* level, const int16_t* sigma, const int16_t* normal, int count, uint8_t* out) const;

  View view_;
  Scene scene_;
  Robot robot_;
  Outline outline_;
  bool from_above_;  // nothing but what the outline has can be met
  uint64_t seed_;
  Shared<Sight> sight_;                // per pixel centre
  Shared<float> floor_dn_, glare_dn_;  // background before noise: what shade takes, the rest
  Shared<int16_t> level_, sigma_;      // the same in the noise stage's steps
  std::vector<int16_t> normal_;
  std::vector<Sample> samples_;
  std::vector<Samples> dated_;  // the same, set by set, for the poses in `slots_`
  std::vector<Colour> colour_of_id_;
  std::vector<uint8_t> mark_id_, edge_of_ids_;
  int reach_ = 1;  // px that the lens blur carries an edge
  float robot_radius_ = 0, robot_height_ = 0;
  std::vector<Pose> slots_;                         // as last drawn
  std::vector<Part> parts_;                         // what was drawn of it so far
  Window shaded_{0, 0, 0, 0}, hidden_{0, 0, 0, 0};  // what the robot shades; what it may hide
  std::vector<uint8_t> id_first_, id_last_, flags_, flags_row_;
  std::vector<float> dn_, shade_;
};

// Normalised, undistorted coordinates of a pixel, by fixed-point iteration.
void undistort(const View& view, double u, double v, double& x, double& y);
// Pixel of a world point; false when it lies behind the camera.
bool project(const View& view, double x, double y, double z, double& u, double& v);
// Line of sight of a pixel; lean is huge where the pixel does not look down.
Sight line_of_sight(const View& view, double u, double v);

}  // namespace camera
