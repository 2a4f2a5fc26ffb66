// Frames in and out: cutting, checking, counting, queueing. What they mean is protocol.cpp's business.
#ifndef HIL_CORE_LINK_H
#define HIL_CORE_LINK_H

#include <stdint.h>

#include "ring.h"
#include "signer.h"
#include "wire.h"

namespace hil {

// Room that everything but wheel state leaves free in the ring, so that a wheel state always fits.
constexpr uint8_t WHEEL_STATE_ROOM = MAVLINK_MSG_ID_WHEEL_STATE_LEN + MAVLINK_NUM_NON_PAYLOAD_BYTES;

struct Link {
  mavlink_message_t rx;
  mavlink_status_t status;  // parser state and the sequence number of frames sent
  Ring tx;
  bool heard;  // a frame has come in, so gaps in its sequence mean losses
  uint8_t next_seq;
  uint32_t received;  // wraps after years
  uint32_t lost;
  uint16_t bad;  // these two stay at their largest value
  uint16_t dropped;
  Signer signer;
};

// Counts one more; a counter that is reported stays at its largest value and does not start again.
inline void count_up(uint16_t& counter) {
  if (counter != UINT16_MAX) ++counter;
}

void link_init(Link& link);
// Takes one byte; true when link.rx holds a good frame.
bool link_take(Link& link, uint8_t byte);
// Queues the packed message, whole or not at all, leaving `room` bytes free. With a key it is not sent before
// it is signed.
void link_send(Link& link, const mavlink_message_t& message, uint8_t room);

// Who sent the frame in link.rx, and its time stamp.
Sender link_sender(const Link& link);
// Starts the next hash there is: of the frame that waits for its check, else of the next to be sent.
bool link_begin_hash(Link& link);
// True when this is the signature of the frame in link.rx, which then waits on to be acted on.
bool link_checked(Link& link, const uint8_t (&signature)[SIGNATURE_SIZE]);
// The signature of the next frame to be sent.
void link_signed(Link& link, const uint8_t (&signature)[SIGNATURE_SIZE]);
// Forgets frames that have not been signed: their key is gone.
void link_forget_unsigned(Link& link);

}  // namespace hil

#endif
