// MAVLink 2 signatures: the key, what is checked and signed with it, time stamps, and their place in storage.
// Off until a key is set. docs/signing.md says why what is as it is.
//
// A signature is the first six bytes of SHA-256 over key, header, payload, CRC, link id and time stamp. Those
// are two blocks at most, hashed in slices between ticks (signer_slice).
//
// Time stamps are 48 bits of 10 us. No frame is acted on whose stamp lies more than a minute after the last one
// stored, and a board starts two minutes after that one: new senders may be one minute behind, so nothing
// that was acted on before a restart can be new after it.
#ifndef HIL_CORE_SIGNER_H
#define HIL_CORE_SIGNER_H

#include <stdint.h>

#include "save.h"
#include "sha256.h"

namespace hil {

using Stamp = uint64_t;

constexpr uint8_t KEY_SIZE = 32;
constexpr uint8_t SIGNATURE_SIZE = 6;
constexpr uint8_t STAMP_SIZE = 6;
constexpr uint8_t SENDERS = 4;
constexpr Stamp STAMP_MINUTE = 6000000;
// No clock says more: 48 bits end in 2104, and a board that took their last stamp would hear nobody again. The
// year behind it is for its own clock.
constexpr Stamp STAMP_MOST = 0xFFFFFFFFFFFF - 525600 * STAMP_MINUTE;
// What of a frame is hashed after the key: header, payload, CRC, link id, stamp; room for its padding too.
constexpr uint8_t SIGNED_PAD = 2 * SHA_BLOCK - KEY_SIZE;

// Two records of the key, written in turn; behind them 256 of the time stamp, written round and round.
constexpr uint8_t KEY_RECORD = 4 + KEY_SIZE + 4;
constexpr uint16_t KEY_AT = STORAGE_SIZE;
constexpr uint16_t KEY_SLOT = 64;
constexpr uint16_t STAMPS_AT = 1024;
constexpr uint16_t STAMP_SLOTS = 256;
constexpr uint8_t STAMP_RECORD = STAMP_SIZE + 4;
constexpr uint16_t BOARD_STORAGE_SIZE = STAMPS_AT + STAMP_SLOTS * STAMP_RECORD;
static_assert(BOARD_STORAGE_SIZE <= 4096, "the EEPROM of the Mega 2560");

enum class Signing : uint8_t { OFF, ON, LOCKED };         // LOCKED: what is stored of a key is damaged
enum class HashJob : uint8_t { NONE, CHECK, SIGN, ACT };  // ACT: checked, and good
enum class KeyWrite : uint8_t { NONE, KEY, WIPE, STAMP };

struct Sender {
  uint8_t system, component, link;
  Stamp last;  // 0: nobody
};

struct Signer {
  Signing mode;
  Sha256 sha;
  uint32_t key[SHA_WORDS];    // the first words of the first block
  uint32_t early[SHA_WORDS];  // a to h after the eight rounds that are the key's alone
  HashJob job;
  bool second;  // a second block follows
  uint8_t text[SIGNED_PAD];
  bool waiting;             // the frame in link.rx waits for its check
  uint32_t arrived_us;      // when it came
  uint32_t heard;           // frames found good
  Stamp now, kept, wanted;  // own stamp; the last in storage; the one that is to be stored soon, 0 none
  Sender senders[SENDERS];
  KeyWrite writing;
  uint8_t record[KEY_RECORD];
  uint8_t size, next;  // of the record, and its byte to hand out
  uint16_t at;
  uint8_t slot, serial;  // the next key's
  uint8_t stamp_slot;    // the next stamp's
  bool key_written;      // to be said
};

// Sets a key: 32 bytes, all zero for none; time stamps go on from `begin`, unless that is beyond STAMP_MOST. Its
// record is to be stored (signer_store). False, and nothing changes, where it is the key in force.
bool signer_set_key(Signer& s, const uint8_t* key, Stamp begin);
// What the storage holds; true when that is a damaged key.
bool signer_load(Signer& s, StorageRead read, void* storage);
// True when `out` is to be written now; call when the storage has finished the byte before.
bool signer_store(Signer& s, StoredByte& out);
// Once a tick: time goes on.
void signer_tick(Signer& s);

// Whether a frame with this stamp may come from this sender; none has stamp 0, or one beyond STAMP_MOST.
bool signer_is_new(const Signer& s, const Sender& from);
// Takes note of a frame that was found good. False when it lies too far ahead to be acted on yet.
bool signer_take(Signer& s, const Sender& from);
// The stamp of the next frame out.
Stamp signer_stamp(Signer& s);

// Starts to hash the key and the first n bytes of `text`.
void signer_begin(Signer& s, HashJob job, uint8_t n);
// A slice of it; true when `signature` is there.
bool signer_slice(Signer& s, uint8_t (&signature)[SIGNATURE_SIZE]);

}  // namespace hil

#endif
