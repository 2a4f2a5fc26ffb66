#include "wire.h"

#include "crc32.h"

namespace {

const mavlink_msg_entry_t ENTRIES[] = MAVLINK_MESSAGE_CRCS;
constexpr uint8_t ENTRY_COUNT = sizeof(ENTRIES) / sizeof(ENTRIES[0]);

}  // namespace

const mavlink_msg_entry_t* mavlink_get_msg_entry(uint32_t msgid) {
  for (uint8_t i = 0; i < ENTRY_COUNT; ++i) {
    if (ENTRIES[i].msgid == msgid) return &ENTRIES[i];
  }
  return nullptr;
}

namespace hil {

uint32_t dialect_hash() {
  uint32_t crc = 0;
  for (uint8_t i = 0; i < ENTRY_COUNT; ++i) {
    if (ENTRIES[i].msgid == MAVLINK_MSG_ID_SETUP_SIGNING) continue;
    crc = crc32(crc, &ENTRIES[i].msgid, 4);
    crc = crc32(crc, &ENTRIES[i].crc_extra, 1);
    crc = crc32(crc, &ENTRIES[i].max_msg_len, 1);
  }
  return crc;
}

}  // namespace hil
