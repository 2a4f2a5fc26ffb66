// Wheel-speed firmware of the skid-steer robot on an Arduino Mega 2560: a control tick at 250 Hz,
// asleep in between. Build with `hil firmware build`, arduino-cli or the Arduino IDE.
//
// The control, safety and link are src/core, which also runs on the host and in the twin; src/board
// is what only this processor has: pins, timers, serial ports, converter, EEPROM.
#include <Arduino.h>
#include <avr/sleep.h>

#include "src/board/battery.h"
#include "src/board/encoders.h"
#include "src/board/host_port.h"
#include "src/board/motors.h"
#include "src/board/restart.h"
#include "src/board/storage.h"
#include "src/board/ticker.h"
#include "src/board/uart.h"
#include "src/core/board.h"
#include "src/core/report.h"

namespace {

using namespace hil;

Board g_board;
uint8_t g_ticks_done;
uint16_t g_longest_us;  // tick of this second
uint8_t g_ticks_to_load_report = 250;
bool g_hashing;  // the core has signatures to check or to make

// Idle keeps timers and serial ports running. The look is taken with interrupts off, or one that came
// between the look and the sleep would wait for the next.
void sleep_until_work() {
  for (;;) {
    cli();
    if (ticker::count() != g_ticks_done || uart::has_received() || g_hashing) break;
    sleep_enable();
    sei();
    sleep_cpu();
    sleep_disable();
  }
  sei();
}

void note_load(uint16_t tick_us) {
  if (tick_us > g_longest_us) g_longest_us = tick_us;
  if (--g_ticks_to_load_report != 0) return;
  g_board.load_permille = g_longest_us / (TICK_US / 1000);
  g_longest_us = 0;
  g_ticks_to_load_report = 250;
}

// Neither is inlined: its frame would lie under everything else that loop() calls.
__attribute__((noinline)) void start() {
  motors::start();
  TCCR0B = TCCR2B = TCCR3B = 0;  // Arduino's timers: nothing here uses millis() or analogWrite()
  board_init(g_board);
  storage::load(g_board);
  if (restart::was_armed()) say(g_board, Text::RESTARTED_ARMED);
  battery::start();
  uart::start();
  encoders::start();
  set_sleep_mode(SLEEP_MODE_IDLE);
  ticker::start();
  restart::start_watchdog();
}

__attribute__((noinline)) void tick() {
  const uint32_t begin_us = ticker::now_us();
  const encoders::Counts counts = encoders::read();
  const BoardInputs inputs = {begin_us, counts.left, counts.right, counts.illegal,
                              battery::read_mv()};
  BoardOutputs outputs;
  board_tick(g_board, inputs, outputs);
  motors::write(outputs.pwm_left, outputs.pwm_right);
  const bool armed = g_board.safety.state == HIL_STATE_ARMED;
  motors::show_armed(armed);
  restart::remember_armed(armed);
  storage::tick(g_board);
  note_load(static_cast<uint16_t>(ticker::now_us() - begin_us));
}

}  // namespace

void setup() { start(); }

void loop() {
  sleep_until_work();
  // A slice may have taken long, and bytes may have waited for it: a tick that is due waits for no more.
  if (!g_hashing || ticker::count() == g_ticks_done) host_port::pump(g_board);
  const uint8_t now = ticker::count();
  if (now == g_ticks_done) {
    g_hashing = board_idle(g_board);
    return;
  }
  g_ticks_done = now;
  tick();
  host_port::pump(g_board);
  board_slack(g_board);
  g_hashing = board_hashes(g_board);
  restart::feed_watchdog();
}
