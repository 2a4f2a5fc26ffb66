// Parameters in EEPROM. A save is spread over the ticks, one byte each, so that none waits for the
// 3.4 ms a byte takes; a save cut short leaves an image whose checksum does not hold.
#pragma once

#include "../core/board.h"

namespace hil {
namespace storage {

// Puts the stored parameters into force, or leaves the defaults when there are none that are sound.
void load(Board& board);

// Once a tick: takes a wish to save from the board, and writes the next byte of a running save.
void tick(Board& board);

}  // namespace storage
}  // namespace hil
