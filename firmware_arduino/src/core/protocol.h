// What frames mean: commands, set-points, parameters, time. Answers go into the board's ring.
#ifndef HIL_CORE_PROTOCOL_H
#define HIL_CORE_PROTOCOL_H

#include <stdint.h>

#include "board.h"

namespace hil {

// Acts on the frame in b.link.rx, which arrived by t_us.
void protocol_handle(Board& b, uint32_t t_us);
// Makes parameters take effect after a change to b.params.
void protocol_retune(Board& b);

}  // namespace hil

#endif
