// SHA-256 (FIPS 180-4), one block at a time and each block in slices, so that a tick need not wait for it.
#ifndef HIL_CORE_SHA256_H
#define HIL_CORE_SHA256_H

#include <stdint.h>

namespace hil {

constexpr uint8_t SHA_WORDS = 8;
constexpr uint8_t SHA_BLOCK = 64;        // bytes
constexpr uint8_t SHA_ROUNDS = 64;       // of a block
constexpr uint8_t SHA_SLICE_ROUNDS = 8;  // 0.17 ms on the board

struct Sha256 {
  uint32_t h[SHA_WORDS];   // of the blocks so far
  uint32_t v[SHA_WORDS];   // a to h of the block under way
  uint32_t w[SHA_ROUNDS];  // its words: the first sixteen given, the others made of them
  uint8_t round;           // to come next
};

void sha256_init(Sha256& s);
// The words of `bytes` (four each, highest first) from w[at] on.
void sha256_words(Sha256& s, uint8_t at, const uint8_t* bytes, uint8_t words);
// Starts with the block whose sixteen words are given.
void sha256_begin(Sha256& s);
// The next eight rounds. True when they were the block's last, and h has it.
bool sha256_slice(Sha256& s);
// A byte of the digest.
uint8_t sha256_byte(const Sha256& s, uint8_t index);

}  // namespace hil

#endif
