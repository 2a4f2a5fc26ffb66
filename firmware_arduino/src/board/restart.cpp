#include "restart.h"

#include <avr/io.h>
#include <avr/wdt.h>
#include <stdint.h>

namespace hil {
namespace restart {
namespace {

constexpr uint32_t kArmed = 0x41524D44;  // not what RAM holds by chance at power-on

uint32_t g_armed __attribute__((section(".noinit")));

}  // namespace

// After a watchdog reset the watchdog runs on at its shortest period, 16 ms: it has to be stopped
// before anything else is set up. The Arduino bootloader clears MCUSR, so this asks nobody why.
extern "C" void hil_stop_watchdog() __attribute__((naked, used, section(".init3")));
void hil_stop_watchdog() {
  MCUSR = 0;
  wdt_disable();
}

bool was_armed() { return g_armed == kArmed; }
void remember_armed(bool armed) { g_armed = armed ? kArmed : 0; }
void start_watchdog() { wdt_enable(WDTO_60MS); }
void feed_watchdog() { wdt_reset(); }

}  // namespace restart
}  // namespace hil
