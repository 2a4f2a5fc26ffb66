// Which of the two serial ports the host is on. Both are listened to, but only one at a time is the
// board's, or the frames of two hosts would mix. At power-up it is the Bluetooth one.
#pragma once

#include "../core/board.h"

namespace hil {
namespace host_port {

// Passes on what has been received, and queues what the board has to say.
void pump(Board& board);

}  // namespace host_port
}  // namespace hil
