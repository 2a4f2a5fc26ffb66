// Cosine and sine of an angle, of sums, products and comparisons alone: the same bits on every processor, with
// every C library, and in every lane of a register. Each is within 0.56 units of the last place of the exact value
// (tests/twin/test_direction.py); one of the 254,647 numbers next to quarter turns, of which sine or cosine is all but
// 0, is 0.65 off. The sine is odd and the cosine even to the bit. Nothing branches on the angle but this: from kNear_rad on, where a heading never gets, it is reduced in whole numbers, lane by lane.
//
// `M` brings `Number`, `Bits` (whole numbers of 64 bits, as many as numbers), `bits_of`, `number_of`, `magnitude`
// and `direct_where_far`. All is inlined, as in plant_model.hpp.
#pragma once

#include <cstdint>
#include <cstring>

namespace twin {

// What one step calls four times: a chain of results that wait for each other, which a call's way
// through memory makes a tenth longer.
#define TWIN_INLINE [[gnu::always_inline]] inline

template <class N>
struct Direction {
  N cos, sin;
};

// 65,000 whole turns. Below, an angle holds at most 2^18 quarter turns, which the first two parts of one bear
// without rounding.
constexpr double kNear_rad = 4e5;

// Any angle; not a number for what is infinite or no number.
Direction<double> direction(double angle_rad);
[[gnu::cold, gnu::noinline]] Direction<double> direction_far(double angle_rad);

template <class M>
struct Directions {
  using N = typename M::Number;
  using B = typename M::Bits;

  TWIN_INLINE static Direction<N> of(const N& angle_rad) {
    const N size = M::magnitude(angle_rad);
    const Rest r = rest(size);
    const B sign = M::bits_of(angle_rad) & (std::uint64_t{1} << 63);
    Direction<N> out = turned_by(r.quarters, near(r.angle, r.low), sign);
    M::direct_where_far(angle_rad, size, out);
    return out;
  }

  // Of an angle of up to an eighth of a turn in two parts, angle + low, the second below the first one's last place.
  TWIN_INLINE static Direction<N> near(const N& angle, const N& low) {
    // To 2^-13: its powers, and a sixth of its third one, are exact; what is left of the first terms of both
    // series is small, and so is what rounding does to it.
    const N head = (angle + kThirteenBits) - kThirteenBits;
    const N head2 = head * head, head3_sixth = head * head2 * kSixth;
    const N cos2 = 1.0 - 0.5 * head2, sin3 = angle - head3_sixth;
    const N d = angle - head, both = angle + head, z = angle * angle;

    const N c = kCos[0] + z * (kCos[1] + z * (kCos[2] + z * (kCos[3] + z * (kCos[4] + z * kCos[5]))));
    const N cos = cos2 + (z * z * c - (0.5 * (d * both) + low * sin3));

    const N more3 = d * (z + head * both);  // angle^3 - head^3
    const N s5 = kSin[2] + z * (kSin[3] + z * (kSin[4] + z * (kSin[5] + z * kSin[6])));
    const N s = kSin[0] + z * (kSin[1] + z * s5);
    const N lost = (angle - sin3) - head3_sixth;
    return {cos, sin3 + (lost + (angle * z * s - kSixth * more3 + low * cos2))};
  }

  // That direction (of an angle that is not negative), quarter turns on, and of the angle's other sign where
  // `sign` says so.
  TWIN_INLINE static Direction<N> turned_by(const B& quarters, const Direction<N>& by, const B& sign) {
    const B other = 0 - (quarters & 1), same = ~other;
    const B c = M::bits_of(by.cos), s = M::bits_of(by.sin);
    return {M::number_of(((c & same) | (s & other)) ^ (((quarters + 1) & 2) << 62)),
            M::number_of(((s & same) | (c & other)) ^ ((quarters & 2) << 62) ^ sign)};
  }

 private:
  struct Rest {
    N angle, low;
    B quarters;  // in its two lowest bits
  };

  // Cody and Waite: whole quarter turns off, in three parts of one.
  TWIN_INLINE static Rest rest(const N& size_rad) {
    const N shifted = size_rad * kPerQuarter + kWhole;
    const N n = shifted - kWhole;
    const N first = size_rad - n * kQuarter[0], minus = n * -kQuarter[1];
    const N second = first + minus;
    const N low = missing(first, minus, second) - n * kQuarter[2];
    const N angle = second + low;
    return {angle, missing(second, low, angle), M::bits_of(shifted)};
  }

  // What rounding took from a + b (Knuth).
  TWIN_INLINE static N missing(const N& a, const N& b, const N& sum) {
    const N of_b = sum - a;
    return (a - (sum - of_b)) + (b - of_b);
  }

  static constexpr double kWhole = 0x1.8p52;  // takes the places behind the point from what is added to it
  static constexpr double kThirteenBits = 0x1.8p39;
  static constexpr double kPerQuarter = 0x1.45f306dc9c883p-1;  // 2 / pi
  // pi / 2: 35 bits, 35 bits, the rest
  static constexpr double kQuarter[3] = {0x1.921fb54440000p+0, 0x1.68c234c400000p-39, 0x1.8cc51701b839ap-72};
  static constexpr double kSixth = 10923.0 / 65536.0;  // 14 bits of it
  // (sin x / x - 1) / x^2 to 2^-68 x^-2, with kSixth taken off, and (cos x - 1 + x^2 / 2) / x^4 to 2^-64 x^-4: the
  // least largest error up to x = pi / 4 (Remez).
  static constexpr double kSin[7] = {0x1.5555555555555p-18, 0x1.111111111110bp-7,   -0x1.a01a01a018ab4p-13,
                                     0x1.71de3a53357d8p-19, -0x1.ae645293042e3p-26, 0x1.61208f4ab8acfp-33,
                                     -0x1.aaa38cd211715p-41};
  static constexpr double kCos[6] = {0x1.555555555554cp-5,   -0x1.6c16c16c15142p-10, 0x1.a01a019cab9dep-16,
                                     -0x1.27e4f805531dep-22, 0x1.1ee9e8a6dd641p-29,  -0x1.8facdd3599f2fp-37};
};

// One number.
struct Scalar {
  using Number = double;
  using Bits = std::uint64_t;

  TWIN_INLINE static Bits bits_of(double v) {
    Bits out;
    std::memcpy(&out, &v, sizeof out);
    return out;
  }
  TWIN_INLINE static double number_of(Bits bits) {
    double out;
    std::memcpy(&out, &bits, sizeof out);
    return out;
  }
  TWIN_INLINE static double magnitude(double v) { return __builtin_fabs(v); }
  TWIN_INLINE static void direct_where_far(double angle_rad, double size_rad, Direction<double>& out) {
    if (__builtin_expect(!(size_rad < kNear_rad), false)) out = direction_far(angle_rad);
  }
};

}  // namespace twin
