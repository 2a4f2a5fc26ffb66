// One block of SHA-256 (FIPS 180-4) for an eight-bit processor, to measure what a signature costs there at
// least: turns by whole bytes are moves, what is left of each turn is at most three shifts by one.
// KLOAD(p) loads a constant; K is put where the includer says (KWHERE).
#pragma once

#define R8(x) ((uint32_t)(x) >> 8 | (uint32_t)(x) << 24)
#define R16(x) ((uint32_t)(x) >> 16 | (uint32_t)(x) << 16)
#define R24(x) ((uint32_t)(x) >> 24 | (uint32_t)(x) << 8)

static inline __attribute__((always_inline)) uint32_t right1(uint32_t x) {
#ifdef __AVR__
  __asm__("bst %A0,0\n\tlsr %D0\n\tror %C0\n\tror %B0\n\tror %A0\n\tbld %D0,7" : "+r"(x));
  return x;
#else
  return x >> 1 | x << 31;
#endif
}

static inline __attribute__((always_inline)) uint32_t left1(uint32_t x) {
#ifdef __AVR__
  __asm__("lsl %A0\n\trol %B0\n\trol %C0\n\trol %D0\n\tadc %A0,__zero_reg__" : "+r"(x));
  return x;
#else
  return x << 1 | x >> 31;
#endif
}

static const uint32_t K[64] KWHERE = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

// Sum over e of turns by 6, 11 and 25, and over a of turns by 2, 13 and 22.
#define ROUND(A, B, C, D, E, F, G, H, i)                                                       \
  {                                                                                            \
    const uint32_t three = right1(right1(right1(E)));                                          \
    const uint32_t sum_e = R8(right1(R16(E)) ^ three ^ left1(left1(E)));                       \
    const uint32_t t = sum_e + H + KLOAD(k) + w[i] + (G ^ (E & (F ^ G)));                      \
    const uint32_t two = left1(left1(A));                                                      \
    const uint32_t sum_a = right1(right1(A)) ^ R24(two) ^ R16(left1(two));                     \
    ++k;                                                                                       \
    D += t;                                                                                    \
    H = t + sum_a + ((A & B) | (C & (A | B)));                                                 \
  }

// Takes 64 bytes into the state h.
static void take_block(uint32_t *h, const uint8_t *message) {
  uint32_t w[16], a[8];
  for (uint8_t i = 0; i < 16; ++i, message += 4) {
    w[i] = (uint32_t)message[0] << 24 | (uint32_t)message[1] << 16 | (uint16_t)(message[2] << 8) | message[3];
  }
  for (uint8_t i = 0; i < 8; ++i) a[i] = h[i];
  const uint32_t *k = K;
  for (uint8_t turn = 0;; ++turn) {
    for (uint8_t i = 0; i < 16; i += 8) {
      ROUND(a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], i)
      ROUND(a[7], a[0], a[1], a[2], a[3], a[4], a[5], a[6], i + 1)
      ROUND(a[6], a[7], a[0], a[1], a[2], a[3], a[4], a[5], i + 2)
      ROUND(a[5], a[6], a[7], a[0], a[1], a[2], a[3], a[4], i + 3)
      ROUND(a[4], a[5], a[6], a[7], a[0], a[1], a[2], a[3], i + 4)
      ROUND(a[3], a[4], a[5], a[6], a[7], a[0], a[1], a[2], i + 5)
      ROUND(a[2], a[3], a[4], a[5], a[6], a[7], a[0], a[1], i + 6)
      ROUND(a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[0], i + 7)
    }
    if (turn == 3) break;
    for (uint8_t i = 0; i < 16; ++i) {
      const uint32_t x = w[(i + 1) & 15], y = w[(i + 14) & 15];
      const uint32_t one = right1(y);
      const uint32_t low = R8(left1(x)) ^ R16(right1(right1(x))) ^ x >> 3;
      const uint32_t high = R16(one) ^ R16(right1(right1(one))) ^ (y >> 8) >> 2;
      w[i] += low + high + w[(i + 9) & 15];
    }
  }
  for (uint8_t i = 0; i < 8; ++i) h[i] += a[i];
}
