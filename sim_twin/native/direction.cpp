#include "direction.hpp"

#include <cmath>
#include <limits>

namespace twin {
namespace {

using Word = std::uint64_t;
__extension__ typedef unsigned __int128 Double;

// 2 / pi, behind the point.
constexpr Word kPerQuarter[20] = {
    0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561, 0xb7246e3a424dd2e0,
    0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484, 0xe99c7026b45f7e41, 0x3991d639835339f4,
    0x9c845f8bbdf9283b, 0x1ff897ffde05980f, 0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7, 0x4f463f669e5fea2d,
    0x7527bac7ebe5f17b, 0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab, 0xf0cfbc209af4361d};
constexpr Word kEighth[2] = {0xc90fdaa22168c234, 0xc4c6628b80dc1cd1};  // pi / 4, behind the point
constexpr int kWords =
    4;  // that a product keeps: 256 bits, of which an angle's own and leading zeros take 120

// 64 bits of 2 / pi from that bit on.
Word bits_from(int bit) {
  const int word = bit / 64, shift = bit % 64;
  return shift == 0 ? kPerQuarter[word]
                    : (kPerQuarter[word] << shift) | (kPerQuarter[word + 1] >> (64 - shift));
}

// Whole and fraction: 2 bits of quarter turns, then what is left of a quarter turn.
struct Turns {
  Word words[kWords];  // highest first

  void shift_left(int by) {  // by < 64
    if (by == 0) return;
    for (int i = 0; i < kWords; ++i) {
      words[i] = (words[i] << by) | (i + 1 < kWords ? words[i + 1] >> (64 - by) : 0);
    }
  }
  void negate() {
    bool carry = true;
    for (int i = kWords - 1; i >= 0; --i) {
      words[i] = ~words[i] + (carry ? 1 : 0);
      carry = carry && words[i] == 0;
    }
  }
};

// size_rad / (2 pi), whole turns left out (Payne and Hanek): the angle is m 2^exponent, and what m times the bits of
// 2 / pi before the first one here gives is a whole number of turns.
Turns turns_of(double size_rad) {
  int exponent;
  const double mantissa = std::frexp(size_rad, &exponent);
  const auto m = static_cast<Word>(std::ldexp(mantissa, 53));
  exponent -= 53 + 2;  // in turns: four quarters
  const int first = exponent > 0 ? exponent : 0, down = exponent < 0 ? -exponent : 0;
  Word product[kWords + 1] = {};  // of weight 2^0 the first
  Word carry = 0;
  for (int i = kWords - 1; i >= 0; --i) {
    const Double both = static_cast<Double>(m) * bits_from(first + 64 * i) + carry;
    product[i + 1] = static_cast<Word>(both);
    carry = static_cast<Word>(both >> 64);
  }
  product[0] = carry;
  Turns out;
  for (int i = 0; i < kWords; ++i) {
    out.words[i] = down == 0 ? product[i + 1] : (product[i + 1] >> down) | (product[i] << (64 - down));
  }
  return out;
}

}  // namespace

Direction<double> direction(double angle_rad) { return Directions<Scalar>::of(angle_rad); }

Direction<double> direction_far(double angle_rad) {
  const double size_rad = std::fabs(angle_rad);
  if (!(size_rad <= std::numeric_limits<double>::max())) {
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  }
  Turns left = turns_of(size_rad);
  Word quarters = left.words[0] >> 62;
  left.shift_left(2);
  const bool back = left.words[0] >> 63 != 0;  // nearer to the next quarter
  if (back) {
    ++quarters;
    left.negate();
  }
  int zeros = 0;
  for (; left.words[0] >> 63 == 0; ++zeros) left.shift_left(1);
  // Times pi / 2, 128 bits of each: twice as many, of which the upper ones count.
  const Word *a = left.words, *b = kEighth;
  const Double high = static_cast<Double>(a[0]) * b[0];
  const Double middle = (static_cast<Double>(a[0]) * b[1] >> 64) + (static_cast<Double>(a[1]) * b[0] >> 64);
  const Double angle = high + middle;
  const double first = std::ldexp(static_cast<double>(static_cast<Word>(angle >> 75)), 75 - 127 - zeros);
  const double second = std::ldexp(static_cast<double>(static_cast<Word>(angle >> 11)), 11 - 127 - zeros);
  const double sum = first + second;
  const double rest = back ? -sum : sum, low = back ? -(second - (sum - first)) : second - (sum - first);
  return Directions<Scalar>::turned_by(quarters, Directions<Scalar>::near(rest, low),
                                       Scalar::bits_of(angle_rad) & (Word{1} << 63));
}

}  // namespace twin
