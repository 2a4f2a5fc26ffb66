#include "signer.h"

#include <string.h>

#include "constants.h"
#include "crc32.h"

namespace hil {

namespace {

constexpr Stamp TICK_STAMPS = TICK_US / 10;
constexpr uint8_t KEY_VERSION = 1;
constexpr uint8_t ERASED = 0xFF;

bool is_zero(const uint8_t* key) {
  uint8_t any = 0;
  for (uint8_t i = 0; i < KEY_SIZE; ++i) any |= key[i];
  return any == 0;
}

Stamp stamp_of(const uint8_t* bytes) {
  Stamp stamp = 0;
  memcpy(&stamp, bytes, STAMP_SIZE);
  return stamp;
}

// The key as words of the first block, and the rounds that only they enter.
void use_key(Signer& s, const uint8_t* key) {
  s.job = HashJob::NONE;
  s.waiting = false;
  memset(s.senders, 0, sizeof(s.senders));
  s.mode = is_zero(key) ? Signing::OFF : Signing::ON;
  sha256_init(s.sha);
  sha256_words(s.sha, 0, key, SHA_WORDS);
  memcpy(s.key, s.sha.w, sizeof(s.key));
  sha256_begin(s.sha);
  sha256_slice(s.sha);
  memcpy(s.early, s.sha.v, sizeof(s.early));
}

bool has_key(const Signer& s, const uint8_t* key) {
  uint8_t differs = 0;
  for (uint8_t i = 0; i < KEY_SIZE; ++i) differs |= key[i] ^ reinterpret_cast<const uint8_t*>(s.key)[i ^ 3u];
  return differs == 0;
}

uint16_t key_place(uint8_t slot) { return static_cast<uint16_t>(KEY_AT + slot * KEY_SLOT); }

void begin_record(Signer& s, KeyWrite what, uint8_t size, uint16_t at) {
  s.writing = what;
  s.size = size;
  s.next = 0;
  s.at = at;
}

void put_crc(Signer& s, uint8_t n) {
  const uint32_t crc = crc32(0, s.record, n);
  memcpy(s.record + n, &crc, 4);
}

bool has_crc(const uint8_t* record, uint8_t n) {
  uint32_t crc;
  memcpy(&crc, record + n, 4);
  return crc == crc32(0, record, n);
}

void store_stamp(Signer& s) {
  const Stamp stamp = s.wanted > s.now ? s.wanted : s.now;
  memcpy(s.record, &stamp, STAMP_SIZE);
  put_crc(s, STAMP_SIZE);
  begin_record(s, KeyWrite::STAMP, STAMP_RECORD,
               static_cast<uint16_t>(STAMPS_AT + s.stamp_slot * STAMP_RECORD));
}

// The record is whole: what that means, and what is written next.
void end_record(Signer& s) {
  const KeyWrite done = s.writing;
  s.writing = KeyWrite::NONE;
  if (done == KeyWrite::KEY) {  // the key before is erased
    s.slot ^= 1u;
    memset(s.record, ERASED, sizeof(s.record));
    begin_record(s, KeyWrite::WIPE, KEY_RECORD, key_place(s.slot));
  } else if (done == KeyWrite::WIPE) {
    s.key_written = true;
  } else {
    s.kept = stamp_of(s.record);
    ++s.stamp_slot;
    if (s.now < s.kept) s.now = s.kept;
    if (s.wanted <= s.kept) s.wanted = 0;
  }
}

void load_stamps(Signer& s, StorageRead read, void* storage) {
  for (uint16_t i = 0; i < STAMP_SLOTS; ++i) {
    read(storage, static_cast<uint16_t>(STAMPS_AT + i * STAMP_RECORD), s.record, STAMP_RECORD);
    const Stamp stamp = stamp_of(s.record);
    if (stamp <= s.kept || !has_crc(s.record, STAMP_SIZE)) continue;
    s.kept = stamp;
    s.stamp_slot = static_cast<uint8_t>(i + 1u);
  }
  s.now = s.kept == 0 ? 0 : s.kept + 2 * STAMP_MINUTE + 1;
}

bool is_of(const Sender& known, const Sender& from) {
  return known.last != 0 && known.system == from.system && known.component == from.component &&
         known.link == from.link;
}

// Index of the sender, of a free place, or of one that nobody can be confused with any more; SENDERS: none.
uint8_t place_of(const Signer& s, const Sender& from) {
  uint8_t free = SENDERS;
  for (uint8_t i = 0; i < SENDERS; ++i) {
    const Sender& known = s.senders[i];
    if (known.last == 0 || known.last + STAMP_MINUTE < s.now) free = i;
    if (is_of(known, from)) return i;
  }
  return free;
}

}  // namespace

bool signer_set_key(Signer& s, const uint8_t* key, Stamp begin) {
  if (s.mode != Signing::LOCKED && has_key(s, key)) return false;
  use_key(s, key);
  if (s.mode == Signing::ON) s.wanted = begin > s.now && begin <= STAMP_MOST ? begin : s.now;
  s.record[0] = 'H';
  s.record[1] = 'K';
  s.record[2] = KEY_VERSION;
  s.record[3] = s.serial++;
  memcpy(s.record + 4, key, KEY_SIZE);
  put_crc(s, 4 + KEY_SIZE);
  begin_record(s, KeyWrite::KEY, KEY_RECORD, key_place(s.slot));
  return true;
}

bool signer_load(Signer& s, StorageRead read, void* storage) {
  bool any = false, damaged = false;
  for (uint8_t slot = 0; slot < 2; ++slot) {
    read(storage, key_place(slot), s.record, 2);
    if (s.record[0] != 'H' || s.record[1] != 'K') continue;
    read(storage, key_place(slot), s.record, KEY_RECORD);
    if (s.record[2] != KEY_VERSION || !has_crc(s.record, 4 + KEY_SIZE)) {
      damaged = true;
      continue;
    }
    if (any && static_cast<int8_t>(s.record[3] - s.serial) < 0) continue;
    any = true;
    s.serial = static_cast<uint8_t>(s.record[3] + 1u);
    s.slot = static_cast<uint8_t>(1u - slot);
    use_key(s, s.record + 4);
  }
  if (any) load_stamps(s, read, storage);
  if (damaged && s.mode == Signing::OFF) s.mode = Signing::LOCKED;  // cut short after one was erased, too
  return s.mode == Signing::LOCKED;
}

bool signer_store(Signer& s, StoredByte& out) {
  if (s.writing == KeyWrite::NONE) return false;
  out = {static_cast<uint16_t>(s.at + s.next), s.record[s.next]};
  if (++s.next == s.size) end_record(s);
  return true;
}

void signer_tick(Signer& s) {
  if (s.mode != Signing::ON) return;
  s.now += TICK_STAMPS;
  if (s.writing == KeyWrite::NONE && (s.wanted != 0 || s.now > s.kept + STAMP_MINUTE / 2)) store_stamp(s);
}

bool signer_is_new(const Signer& s, const Sender& from) {
  if (from.last == 0 || from.last > STAMP_MOST) return false;
  const uint8_t place = place_of(s, from);
  if (place == SENDERS) return false;
  const Sender& known = s.senders[place];
  return is_of(known, from) ? from.last > known.last : from.last + STAMP_MINUTE >= s.now;
}

bool signer_take(Signer& s, const Sender& from) {
  if (from.last > s.kept + STAMP_MINUTE) {
    if (from.last > s.wanted) s.wanted = from.last;
    return false;
  }
  s.senders[place_of(s, from)] = from;
  if (from.last > s.now) s.now = from.last;
  ++s.heard;
  return true;
}

Stamp signer_stamp(Signer& s) { return ++s.now; }

void signer_begin(Signer& s, HashJob job, uint8_t n) {
  const uint16_t bits = static_cast<uint16_t>((KEY_SIZE + n) * 8u);
  s.job = job;
  s.second = KEY_SIZE + n + 9 > SHA_BLOCK;
  memset(s.text + n, 0, static_cast<uint8_t>(SIGNED_PAD - n));
  s.text[n] = 0x80;
  const uint8_t end = s.second ? SIGNED_PAD : SHA_BLOCK - KEY_SIZE;
  s.text[end - 2] = static_cast<uint8_t>(bits >> 8);
  s.text[end - 1] = static_cast<uint8_t>(bits);
  sha256_init(s.sha);
  memcpy(s.sha.w, s.key, sizeof(s.key));
  sha256_words(s.sha, SHA_WORDS, s.text, SHA_WORDS);
  memcpy(s.sha.v, s.early, sizeof(s.early));
  s.sha.round = SHA_SLICE_ROUNDS;
}

bool signer_slice(Signer& s, uint8_t (&signature)[SIGNATURE_SIZE]) {
  if (!sha256_slice(s.sha)) return false;
  if (s.second) {
    s.second = false;
    sha256_words(s.sha, 0, s.text + SHA_BLOCK - KEY_SIZE, 2 * SHA_WORDS);
    sha256_begin(s.sha);
    return false;
  }
  for (uint8_t i = 0; i < SIGNATURE_SIZE; ++i) signature[i] = sha256_byte(s.sha, i);
  s.job = HashJob::NONE;
  return true;
}

}  // namespace hil
