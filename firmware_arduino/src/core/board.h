// The whole board below the pins: bytes and encoder counts in, PWM and bytes out. Time is an argument.
#ifndef HIL_CORE_BOARD_H
#define HIL_CORE_BOARD_H

#include <stdint.h>

#include "constants.h"
#include "link.h"
#include "params.h"
#include "save.h"
#include "safety.h"
#include "wheel_loop.h"

namespace hil {

// One snapshot, taken at t_us with interrupts off.
struct BoardInputs {
  uint32_t t_us;        // board clock, wraps
  int32_t counts_left;  // rise when the wheel drives forward
  int32_t counts_right;
  uint16_t encoder_faults;  // illegal transitions of both encoders since start, wraps
  uint16_t battery_mv;
};

struct BoardOutputs {
  int16_t pwm_left;  // -PWM_TOP to PWM_TOP, positive drives forward, 0 is bridge off
  int16_t pwm_right;
};

struct Setpoint {
  float omega_rad_s[SIDES];
  uint16_t seq;
  uint32_t t_us;  // when it arrived
  bool any;       // one has come since arming
};

constexpr uint8_t TEXT_BYTES = 6;  // a bit per text of texts.def

struct Board {
  Params params;
  uint32_t parameter_hash;
  uint32_t dialect_hash;
  WheelTuning tuning;
  SafetyLimits limits;
  Safety safety;
  Wheel wheel[SIDES];
  Setpoint setpoint;
  Link link;
  BoardInputs inputs;   // of the last tick
  bool ticked;          // a tick has been, so `inputs` and the encoder zero are real
  uint8_t slot;         // place in the one-second schedule of reports, in ticks
  uint8_t params_next;  // next parameter of a running list; PARAM_COUNT: none
  uint8_t texts_waiting[TEXT_BYTES];
  uint8_t texts_sent[TEXT_BYTES];  // in this second
  uint32_t default_hash;           // parameter hash of the defaults
  Save save;
  bool retune_due;         // parameters have changed and `tuning` and `limits` have not
  uint8_t retune_wait;     // ticks until it may be worked out while armed
  uint16_t overruns;       // ticks that came more than half a period late
  uint16_t refused;        // set-points
  uint16_t load_permille;  // longest tick of the last second; set by the layer that can measure it
  bool wired;              // what is received comes over the USB port; set by the layer that knows
};

// Defaults in force, disarmed, nothing queued.
void board_init(Board& b);
// Takes bytes that had arrived by t_us: n of them, or fewer when one ends a frame that is costly to act on,
// so that a tick that is due need not wait for the next such frame, or that waits for its signature to be
// checked (board_idle). Returns how many.
uint16_t board_receive(Board& b, const uint8_t* bytes, uint16_t n, uint32_t t_us);
// One control period; call every TICK_US.
void board_tick(Board& b, const BoardInputs& in, BoardOutputs& out);
// What a tick leaves for later: parameters that have changed take effect. Call once behind every tick, when
// its outputs are on the pins.
void board_slack(Board& b);
// A slice of what signatures need, 0.2 ms; for whenever there is nothing else to do. True while there is more.
bool board_idle(Board& b);
// Whether there is any.
bool board_hashes(const Board& b);
// Counts the frames of a host that may command: with a key, those it has signed.
uint32_t board_heard(const Board& b);
// Hands out up to `max` bytes for the serial port; returns how many.
uint16_t board_transmit(Board& b, uint8_t* out, uint16_t max);

// Parameters from storage: call after board_init. Where nothing is sound the defaults stay in force. What
// is damaged is said.
ImageResult board_load(Board& b, StorageRead read, void* storage);
// To be called whenever the storage has finished the byte before: true when `out` is to be written now. The
// host's order to store is acknowledged once the last one is in.
bool board_store(Board& b, StoredByte& out);

}  // namespace hil

#endif
