// Python's view of the renderer: plain structs filled field by field, and make().
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "render.hpp"

namespace nb = nanobind;

namespace {

using Image = nb::ndarray<nb::numpy, uint8_t, nb::shape<-1, -1, 3>>;
using Canvas = nb::ndarray<uint8_t, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;
using FloatImage = nb::ndarray<const float, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;

std::vector<float> flat(const FloatImage& image) { return {image.data(), image.data() + image.size()}; }

// Memory of frames that nobody holds any more, for the next ones: fresh memory of that size has to be
// cleared by the system each time, which takes as long as drawing.
class Sheets {
 public:
  using Pixels = std::unique_ptr<uint8_t[]>;

  Pixels take(size_t size) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (kept_.empty()) return Pixels(new uint8_t[size]);
    Pixels out = std::move(kept_.back());
    kept_.pop_back();
    return out;
  }

  void give(Pixels pixels) noexcept {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (kept_.size() < kept_.capacity()) kept_.push_back(std::move(pixels));
  }

  Sheets() { kept_.reserve(MOST_KEPT); }

 private:
  static constexpr size_t MOST_KEPT = 4;
  std::mutex mutex_;  // an array may die in any thread
  std::vector<Pixels> kept_;
};

// One frame's memory, which goes back when the array on it dies.
struct Sheet {
  std::shared_ptr<Sheets> sheets;
  Sheets::Pixels pixels;

  Sheet(std::shared_ptr<Sheets> from, Sheets::Pixels taken)
      : sheets(std::move(from)), pixels(std::move(taken)) {}
  ~Sheet() { sheets->give(std::move(pixels)); }
};

// A renderer that knows its own size, so that Python gets whole arrays.
struct Bound {
  camera::View view;
  camera::Renderer renderer;
  std::shared_ptr<Sheets> sheets = std::make_shared<Sheets>();

  Bound(const camera::View& v, const camera::Scene& s, const camera::Robot& r, uint64_t seed)
      : view(checked(v, s)), renderer(v, s, r, seed) {}

  Bound(const Bound& other, uint64_t seed) : view(other.view), renderer(other.renderer, seed) {}

  static const camera::View& checked(const camera::View& v, const camera::Scene& s) {
    const size_t pixels = static_cast<size_t>(v.width) * v.height;
    if (v.width < 2 || v.height < 2 || s.light.size() != pixels || s.glare.size() != pixels)
      throw std::invalid_argument("light and glare must have the view's height and width");
    if (s.texture_size < 1 || s.texture.size() != size_t(s.texture_size) * s.texture_size)
      throw std::invalid_argument("the floor texture must be square");
    return v;
  }

  // A frame's memory, nothing drawn in it.
  Image blank() {
    const size_t height = view.height, width = view.width;
    auto sheet = std::make_unique<Sheet>(sheets, sheets->take(height * width * 3));
    uint8_t* const pixels = sheet->pixels.get();
    nb::capsule owner(sheet.get(), [](void* p) noexcept { delete static_cast<Sheet*>(p); });
    sheet.release();
    return Image(pixels, {height, width, 3}, owner);
  }

  Image make(uint64_t index, const std::vector<std::array<double, 3>>& poses) {
    Image image = blank();
    renderer.make(index, poses, image.data());
    return image;
  }

  void draw(uint64_t index, const std::vector<std::array<double, 3>>& poses, const std::array<int, 4>& window,
            const Canvas& image) {
    const size_t height = view.height, width = view.width;
    const auto [left, top, right, bottom] = window;
    if (image.shape(0) != height || image.shape(1) != width)
      throw std::invalid_argument("image must have the view's height and width");
    if (left < 0 || top < 0 || right > view.width || bottom > view.height)
      throw std::invalid_argument("window must lie in the view");
    renderer.draw(index, poses, {left, top, right, bottom}, image.data());
  }
};

// World (X, Y) on the floor seen by every pixel, (height, width, 2), m.
nb::ndarray<nb::numpy, double, nb::shape<-1, -1, 2>> floor_map(const camera::View& view) {
  const size_t height = view.height, width = view.width;
  auto data = std::make_unique<double[]>(height * width * 2);
  for (size_t v = 0; v < height; ++v)
    for (size_t u = 0; u < width; ++u) {
      const camera::Sight s = camera::line_of_sight(view, static_cast<double>(u), static_cast<double>(v));
      data[2 * (v * width + u)] = s.x;
      data[2 * (v * width + u) + 1] = s.y;
    }
  nb::capsule owner(data.get(), [](void* p) noexcept { delete[] static_cast<double*>(p); });
  return {data.release(), {height, width, 2}, owner};
}

}  // namespace

void bind_render(nb::module_& m) {
  using namespace camera;
  nb::class_<View>(m, "View")
      .def(nb::init<>())
      .def_rw("width", &View::width)
      .def_rw("height", &View::height)
      .def_rw("fx", &View::fx)
      .def_rw("fy", &View::fy)
      .def_rw("cx", &View::cx)
      .def_rw("cy", &View::cy)
      .def_rw("dist", &View::dist)
      .def_rw("below", &View::below)
      .def_rw("fisheye", &View::fisheye)
      .def_rw("R", &View::R)
      .def_rw("t", &View::t);
  nb::class_<Patch>(m, "Patch")
      .def(nb::init<>())
      .def_rw("disc", &Patch::disc)
      .def_rw("mark", &Patch::mark)
      .def_rw("x", &Patch::x)
      .def_rw("y", &Patch::y)
      .def_rw("half_x", &Patch::half_x)
      .def_rw("half_y", &Patch::half_y)
      .def_rw("colour", &Patch::colour);
  nb::class_<Grid>(m, "Grid")
      .def(nb::init<>())
      .def_rw("cells", &Grid::cells)
      .def_rw("x", &Grid::x)
      .def_rw("y", &Grid::y)
      .def_rw("half", &Grid::half)
      .def_rw("margin", &Grid::margin)
      .def_rw("white", &Grid::white);
  nb::class_<Block>(m, "Block")
      .def(nb::init<>())
      .def_rw("disc", &Block::disc)
      .def_rw("x", &Block::x)
      .def_rw("y", &Block::y)
      .def_rw("half_x", &Block::half_x)
      .def_rw("half_y", &Block::half_y)
      .def_rw("theta", &Block::theta)
      .def_rw("top", &Block::top)
      .def_rw("colour", &Block::colour);
  nb::class_<Bar>(m, "Bar")
      .def(nb::init<>())
      .def_rw("body", &Bar::body)
      .def_rw("x0", &Bar::x0)
      .def_rw("y0", &Bar::y0)
      .def_rw("x1", &Bar::x1)
      .def_rw("y1", &Bar::y1)
      .def_rw("half_width", &Bar::half_width)
      .def_rw("z", &Bar::z)
      .def_rw("colour", &Bar::colour);
  nb::class_<Robot>(m, "Robot")
      .def(nb::init<>())
      .def_rw("half_length", &Robot::half_length)
      .def_rw("half_width", &Robot::half_width)
      .def_rw("bottom", &Robot::bottom)
      .def_rw("top", &Robot::top)
      .def_rw("wheel_radius", &Robot::wheel_radius)
      .def_rw("wheel_half_width", &Robot::wheel_half_width)
      .def_rw("half_track", &Robot::half_track)
      .def_rw("half_base", &Robot::half_base)
      .def_rw("axle_x", &Robot::axle_x)
      .def_rw("plate", &Robot::plate)
      .def_rw("side", &Robot::side)
      .def_rw("tyre", &Robot::tyre)
      .def_rw("hub", &Robot::hub)
      .def_rw("patches", &Robot::patches)
      .def_rw("tag", &Robot::tag);
  nb::class_<Scene>(m, "Scene")
      .def(nb::init<>())
      .def("set_texture",
           [](Scene& s, const FloatImage& image, float step) {
             s.texture = flat(image);
             s.texture_size = static_cast<int>(image.shape(0));
             s.texture_step = step;
           })
      .def("set_light",
           [](Scene& s, const FloatImage& light, const FloatImage& glare) {
             s.light = flat(light);
             s.glare = flat(glare);
           })
      .def_rw("floor", &Scene::floor)
      .def_rw("blocks", &Scene::blocks)
      .def_rw("bars", &Scene::bars)
      .def_rw("white_balance", &Scene::white_balance)
      .def_rw("blur", &Scene::blur)
      .def_rw("read_noise", &Scene::read_noise)
      .def_rw("dn_per_electron", &Scene::dn_per_electron)
      .def_rw("lamp_x", &Scene::lamp_x)
      .def_rw("lamp_y", &Scene::lamp_y)
      .def_rw("shade", &Scene::shade);
  nb::class_<Bound>(m, "Renderer")
      .def(nb::init<const View&, const Scene&, const Robot&, uint64_t>(), nb::arg("view"), nb::arg("scene"),
           nb::arg("robot"), nb::arg("seed"))
      .def(
          "reseeded", [](const Bound& bound, uint64_t seed) { return new Bound(bound, seed); },
          nb::rv_policy::take_ownership, nb::arg("seed"), "The same scene with the noise of another seed.")
      .def("make", &Bound::make, nb::arg("index"), nb::arg("poses"),
           "The frame `index`, (height, width, 3) BGR, with the robot at `poses` (x, y, theta)\n"
           "from the start to the end of the exposure; without poses the empty scene.")
      .def("blank", &Bound::blank, "Memory for a frame, nothing drawn in it.")
      .def("draw", &Bound::draw, nb::arg("index"), nb::arg("poses"), nb::arg("window"), nb::arg("image"),
           "Draws the pixels of a window (left, top, right, bottom) of that frame into `image`.");
  m.def("floor_map", &floor_map, nb::arg("view"),
        "World (X, Y) on the floor seen by every pixel, (height, width, 2), m.");
  m.def(
      "project",
      [](const View& view, double x, double y, double z) {
        std::array<double, 2> px{};
        if (!project(view, x, y, z, px[0], px[1])) throw std::domain_error("behind the camera");
        return px;
      },
      "Pixel (u, v) of a world point, by the renderer's own lens.");
}
