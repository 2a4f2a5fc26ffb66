// Parameters in EEPROM. A save is spread over the ticks, one byte each, so that none waits for the
// 3.4 ms a byte takes. There are two images, written in turn: a save cut short leaves the one before.
#pragma once

#include "../core/board.h"

namespace hil {
namespace storage {

// Puts the stored parameters into force, or leaves the defaults when there are none that are sound.
void load(Board& board);

// Once a tick: writes the next byte of a running save.
void tick(Board& board);

}  // namespace storage
}  // namespace hil
