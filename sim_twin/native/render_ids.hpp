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

constexpr float SHADE_REACH_M = 0.06f;  // penumbra of the robot on the floor: a lamp 1 m wide

}  // namespace camera
