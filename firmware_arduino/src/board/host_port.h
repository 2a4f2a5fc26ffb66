// Which of the two serial ports the host is on. Both are listened to and both carry the reports; the
// bytes of one at a time go to the board, or frames of two hosts would mix.
#pragma once

#include "../core/board.h"

namespace hil {
namespace host_port {

// Passes on what has been received, and queues what the board has to say.
void pump(Board& board);

}  // namespace host_port
}  // namespace hil
