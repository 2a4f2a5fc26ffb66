#include "link.h"

#include <stddef.h>
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

constexpr uint8_t BOARD_LINK_ID = 0;
constexpr uint8_t CRC_SIZE = MAVLINK_NUM_CHECKSUM_BYTES;
// Link id and time stamp come between the CRC and the signature, and are hashed.
constexpr uint8_t HASHED_TAIL = 1 + STAMP_SIZE;
constexpr uint8_t SIGNATURE_BLOCK = HASHED_TAIL + SIGNATURE_SIZE;
static_assert(MAVLINK_MAX_PACKET_LEN - SIGNATURE_SIZE + 9 <= SIGNED_PAD, "two blocks are enough");

// Makes a frame of n bytes a signed one, still without its signature. A CRC is linear: the flag changes it by
// what the flag's bit alone, behind nothing, would make.
uint8_t mark_signed(Link& link, uint8_t* frame, uint8_t n) {
  uint16_t change = 0;
  crc_accumulate(MAVLINK_IFLAG_SIGNED, &change);
  // Seven bytes of header behind the flag, the payload, and CRC_EXTRA.
  for (uint8_t i = static_cast<uint8_t>(n - MAVLINK_NUM_NON_PAYLOAD_BYTES + 8); i > 0; --i) {
    crc_accumulate(0, &change);
  }
  frame[2] |= MAVLINK_IFLAG_SIGNED;
  frame[n - 2] ^= static_cast<uint8_t>(change);
  frame[n - 1] ^= static_cast<uint8_t>(change >> 8);
  const Stamp stamp = signer_stamp(link.signer);
  frame[n] = BOARD_LINK_ID;
  memcpy(frame + n + 1, &stamp, STAMP_SIZE);
  return static_cast<uint8_t>(n + SIGNATURE_BLOCK);
}

void begin_check(Link& link) {
  const mavlink_message_t& rx = link.rx;
  uint8_t* text = link.signer.text;
  memcpy(text, reinterpret_cast<const uint8_t*>(&rx) + offsetof(mavlink_message_t, magic),
         MAVLINK_NUM_HEADER_BYTES);
  text += MAVLINK_NUM_HEADER_BYTES;
  memcpy(text, rx.payload64, rx.len);
  text += rx.len;
  memcpy(text, rx.ck, CRC_SIZE);
  memcpy(text + CRC_SIZE, rx.signature, HASHED_TAIL);
  signer_begin(link.signer, HashJob::CHECK,
               static_cast<uint8_t>(MAVLINK_NUM_NON_PAYLOAD_BYTES + rx.len + HASHED_TAIL));
}

// Bytes of the next frame to be signed that are hashed.
uint8_t hashed_size(const Ring& tx) {
  const uint8_t length = tx.bytes[static_cast<uint8_t>(tx.ready + 1u)];
  return static_cast<uint8_t>(length + MAVLINK_NUM_NON_PAYLOAD_BYTES + HASHED_TAIL);
}

void begin_sign(Link& link) {
  const uint8_t n = hashed_size(link.tx);
  uint8_t at = link.tx.ready;
  for (uint8_t i = 0; i < n; ++i) link.signer.text[i] = link.tx.bytes[at++];
  signer_begin(link.signer, HashJob::SIGN, n);
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
  uint8_t n = static_cast<uint8_t>(mavlink_msg_to_send_buffer(frame, &message));
  const bool sign = link.signer.mode == Signing::ON;
  if (sign) {
    n = mark_signed(link, frame, n);
    if (room > 0) room = static_cast<uint8_t>(room + SIGNATURE_BLOCK);
  }
  if (ring_free(link.tx) < n + room) {
    count_up(link.dropped);
    return;
  }
  ring_put(link.tx, frame, n);
  if (!sign) link.tx.ready = link.tx.head;
}

Sender link_sender(const Link& link) {
  const mavlink_message_t& rx = link.rx;
  Sender from = {rx.sysid, rx.compid, rx.signature[0], 0};
  memcpy(&from.last, rx.signature + 1, STAMP_SIZE);
  return from;
}

bool link_begin_hash(Link& link) {
  if (link.signer.waiting) {
    begin_check(link);
  } else if (link.tx.ready != link.tx.head) {
    begin_sign(link);
  } else {
    return false;
  }
  return true;
}

bool link_checked(Link& link, const uint8_t (&signature)[SIGNATURE_SIZE]) {
  uint8_t differs = 0;
  for (uint8_t i = 0; i < SIGNATURE_SIZE; ++i) differs |= signature[i] ^ link.rx.signature[HASHED_TAIL + i];
  link.signer.waiting = differs == 0;
  return link.signer.waiting;
}

void link_signed(Link& link, const uint8_t (&signature)[SIGNATURE_SIZE]) {
  uint8_t at = static_cast<uint8_t>(link.tx.ready + hashed_size(link.tx));
  for (uint8_t i = 0; i < SIGNATURE_SIZE; ++i) link.tx.bytes[at++] = signature[i];
  link.tx.ready = at;
}

void link_forget_unsigned(Link& link) { link.tx.head = link.tx.ready; }

}  // namespace hil
