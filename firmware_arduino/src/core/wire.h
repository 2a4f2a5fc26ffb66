// The generated dialect with the settings of a small board, and its hash.
#ifndef HIL_CORE_WIRE_H
#define HIL_CORE_WIRE_H

// The generated headers are not ours to hold to our warnings.
#pragma GCC system_header

#include <stdint.h>

#define MAVLINK_COMM_NUM_BUFFERS 1
#define MAVLINK_MAX_PAYLOAD_LEN 54  // STATUSTEXT; a false start of frame costs 66 bytes at most
#define MAVLINK_NO_SIGN_PACKET
#define MAVLINK_NO_SIGNATURE_CHECK
#define MAVLINK_NO_CONVERSION_HELPERS
#define MAVLINK_GET_MSG_ENTRY  // one table in flash or RAM for parser and hash: wire.cpp
#ifdef __AVR__
// The same CRC in avr-libc's assembler: a third of the cycles, and every byte both ways passes it.
#include <util/crc16.h>
#define HAVE_CRC_ACCUMULATE
static inline void crc_accumulate(uint8_t data, uint16_t* crc) { *crc = _crc_ccitt_update(*crc, data); }
#endif
#include "../mavlink/mavlink_types.h"
// A signature is taken off the line with its frame, and checked and made in signer.h.
#undef MAVLINK_IFLAG_MASK
#define MAVLINK_IFLAG_MASK MAVLINK_IFLAG_SIGNED
const mavlink_msg_entry_t* mavlink_get_msg_entry(uint32_t msgid);
#include "../mavlink/hil/mavlink.h"

namespace hil {

// CRC-32 over (msgid u32, crc_extra u8, max length u8), little-endian, in order of msgid. crc_extra
// covers message names, field names and types. The host derives the same from its generated module.
// SETUP_SIGNING is left out: who never sets a key need not know it.
uint32_t dialect_hash();

}  // namespace hil

#endif
