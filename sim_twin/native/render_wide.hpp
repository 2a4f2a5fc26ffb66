// What many lines of sight meet on the robot, worked out side by side: the same ids, to the bit of every sum, as
// Renderer::trace gives one by one.
#pragma once

#include <cstdint>

#include "render.hpp"

// Wide registers where the processor has them, found out at run time. Whole numbers, roots, single products and
// sums have the same bits in any width.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define CAMERA_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define CAMERA_WIDE
#endif

namespace camera {

constexpr uint8_t ID_ASIDE = 255;  // neither plate nor floor at once: sides and wheels have to be asked

// Ids that `count` lines of sight meet, from one pose of the robot.
void meet_row(const Outline& robot, const Pose& pose, const Sight* sights, int count, uint8_t* ids);

// Ids that the first `count` samples of a pixel meet (4, 8 or 24 of them); `in_plane` where nothing but the plate can
// be met.
void meet_samples(const Outline& robot, const SightPatch& patch, const Samples& samples, int count,
                  bool in_plane, uint8_t* ids);

}  // namespace camera
