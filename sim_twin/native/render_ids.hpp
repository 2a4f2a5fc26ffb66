// What a sample can meet, as small numbers: fixed parts first, then patches, then bars.
#pragma once

#include <cstdint>

namespace camera {

enum Id : uint8_t {
  ID_FLOOR = 0,
  ID_SIDE,
  ID_TYRE,
  ID_HUB,
  ID_PLATE,  // from here to the last patch everything lies in the plate's plane
  ID_TAG_WHITE,
  ID_TAG_BLACK,
  ID_PATCH,
};

// What lies near a pixel: an edge, one not in the plate's plane alone, one of a mark, one of more
// than faint contrast.
constexpr uint8_t EDGE = 1, EDGE_SIDES = 2, EDGE_MARK = 4, EDGE_PLAIN = 8;

constexpr float SHADE_REACH_M = 0.06f;  // penumbra of the robot on the floor: a lamp 1 m wide

constexpr int SETS = 64;  // of samples, one of which a pixel takes

// Counter-based: the value depends on the arguments alone (splitmix64).
inline uint64_t hash(uint64_t a, uint64_t b, uint64_t c) {
  uint64_t z = a + 0x9e3779b97f4a7c15ull * (b + 1) + 0xd1b54a32d192ed03ull * (c + 1);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

}  // namespace camera
