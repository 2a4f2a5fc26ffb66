// What the board says of its own accord, and the texts it says it in.
#ifndef HIL_CORE_REPORT_H
#define HIL_CORE_REPORT_H

#include <stdint.h>

#include "board.h"

namespace hil {

enum class Text : uint8_t {
#define TEXT(name, severity, text) name,
#include "texts.def"
#undef TEXT
  COUNT
};

// Has the text sent soon, once a second at most.
void say(Board& b, Text text);
// Says why the supervisor is in the state it is in.
void say_state(Board& b);

// One tick of the schedule: wheel state at 50 Hz; heartbeat and status at 1 Hz; texts at 5 Hz and the
// running parameter list at 10 Hz at most, in ticks of their own.
void report_tick(Board& b);

void send_heartbeat(Board& b);
void send_sys_status(Board& b);
void send_board_info(Board& b);
void send_param(Board& b, uint8_t index);

}  // namespace hil

#endif
