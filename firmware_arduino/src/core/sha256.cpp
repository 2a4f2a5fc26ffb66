#include "sha256.h"

#include <string.h>

#include "flash.h"

#ifdef __AVR__
extern "C" {
// sha256_avr.S
void hil_sha256_rounds(uint32_t* v, const uint32_t* w, const uint32_t* k, uint8_t fours);
void hil_sha256_extend(uint32_t* w, uint8_t n);
}
#endif

namespace hil {

namespace {

constexpr uint32_t K[SHA_ROUNDS] HIL_FLASH = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

constexpr uint32_t START[SHA_WORDS] HIL_FLASH = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                                 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};

#ifndef __AVR__
uint32_t right(uint32_t x, uint8_t n) { return x >> n | x << (32 - n); }

void hil_sha256_rounds(uint32_t* v, const uint32_t* w, const uint32_t* k, uint8_t fours) {
  for (uint8_t i = 0; i < 4 * fours; ++i) {
    const uint32_t a = v[0], b = v[1], c = v[2], e = v[4], f = v[5], g = v[6];
    const uint32_t t = v[7] + (right(e, 6) ^ right(e, 11) ^ right(e, 25)) + (g ^ (e & (f ^ g))) + k[i] + w[i];
    const uint32_t a_new = t + (right(a, 2) ^ right(a, 13) ^ right(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
    const uint32_t e_new = v[3] + t;
    const uint32_t next[SHA_WORDS] = {a_new, a, b, c, e_new, e, f, g};
    memcpy(v, next, sizeof(next));
  }
}

void hil_sha256_extend(uint32_t* w, uint8_t n) {
  for (; n > 0; --n, ++w) {
    const uint32_t x = w[1], y = w[14];
    w[16] = w[0] + (right(x, 7) ^ right(x, 18) ^ x >> 3) + w[9] + (right(y, 17) ^ right(y, 19) ^ y >> 10);
  }
}
#endif

}  // namespace

void sha256_init(Sha256& s) { HIL_FLASH_COPY(s.h, START, sizeof(s.h)); }

void sha256_words(Sha256& s, uint8_t at, const uint8_t* bytes, uint8_t words) {
  uint8_t* out = reinterpret_cast<uint8_t*>(s.w + at);  // board and host keep the lowest byte first
  for (; words > 0; --words, bytes += 4) {
    *out++ = bytes[3];
    *out++ = bytes[2];
    *out++ = bytes[1];
    *out++ = bytes[0];
  }
}

void sha256_begin(Sha256& s) {
  memcpy(s.v, s.h, sizeof(s.v));
  s.round = 0;
}

bool sha256_slice(Sha256& s) {
  uint32_t* const w = s.w + s.round;
  if (s.round >= 16) hil_sha256_extend(w - 16, SHA_SLICE_ROUNDS);
  hil_sha256_rounds(s.v, w, K + s.round, SHA_SLICE_ROUNDS / 4);
  s.round = static_cast<uint8_t>(s.round + SHA_SLICE_ROUNDS);
  if (s.round < SHA_ROUNDS) return false;
  for (uint8_t i = 0; i < SHA_WORDS; ++i) s.h[i] += s.v[i];
  return true;
}

uint8_t sha256_byte(const Sha256& s, uint8_t index) {
  return reinterpret_cast<const uint8_t*>(s.h)[index ^ 3u];
}

}  // namespace hil
