// What frames mean: commands, set-points, parameters, time. Answers go into the board's ring.
#ifndef HIL_CORE_PROTOCOL_H
#define HIL_CORE_PROTOCOL_H

#include <stdint.h>

#include "board.h"

namespace hil {

// Acts on the frame in b.link.rx, which arrived by t_us. True when that was costly: a tick that is due comes
// before the next frame.
bool protocol_handle(Board& b, uint32_t t_us);
// Makes the parameters take effect now.
void protocol_retune(Board& b);
// Answers a command.
void protocol_acknowledge(Board& b, uint16_t command, uint8_t result);

}  // namespace hil

#endif
