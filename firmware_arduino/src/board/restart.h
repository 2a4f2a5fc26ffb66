// What happened before the last reset, and the watchdog that may have caused it.
#pragma once

namespace hil {
namespace restart {

// True when the board was armed when it was reset: by the watchdog, the reset line or a supply dip.
bool was_armed();

// Kept through a reset, which does not clear the RAM; to be called every tick.
void remember_armed(bool armed);

// From now on a main loop that does not call feed() for 64 ms resets the board.
void start_watchdog();
void feed_watchdog();

}  // namespace restart
}  // namespace hil
