#include "link.h"

#include <string.h>

namespace hil {

namespace {

void count_frame(Link& link) {
  const uint8_t gap = static_cast<uint8_t>(link.rx.seq - link.next_seq);
  // A step back is another host or a late frame, not a loss.
  if (link.heard && gap < 128) link.lost += gap;
  link.heard = true;
  link.next_seq = static_cast<uint8_t>(link.rx.seq + 1u);
  ++link.received;
}

}  // namespace

void link_init(Link& link) { memset(&link, 0, sizeof(link)); }

bool link_take(Link& link, uint8_t byte) {
  const uint8_t overruns = link.status.buffer_overrun;
  const uint8_t got = mavlink_frame_char_buffer(&link.rx, &link.status, byte, nullptr, nullptr);
  if (got == MAVLINK_FRAMING_OK) {
    count_frame(link);
    return true;
  }
  if (got == MAVLINK_FRAMING_BAD_CRC) {
    count_up(link.bad);
    if (byte == MAVLINK_STX) {  // the frame was cut short and this is the next one
      link.status.parse_state = MAVLINK_PARSE_STATE_GOT_STX;
      link.rx.magic = byte;
      link.rx.len = 0;
      mavlink_start_checksum(&link.rx);
    }
  }
  if (link.status.buffer_overrun != overruns) count_up(link.bad);
  return false;
}

void link_send(Link& link, const mavlink_message_t& message, uint8_t room) {
  uint8_t frame[MAVLINK_MAX_PACKET_LEN];
  const uint8_t n = static_cast<uint8_t>(mavlink_msg_to_send_buffer(frame, &message));
  if (ring_free(link.tx) < n + room) {
    count_up(link.dropped);
    return;
  }
  ring_put(link.tx, frame, n);
}

}  // namespace hil
