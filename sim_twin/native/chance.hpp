// Numbers drawn as Python's random.Random draws them, from its state: the Mersenne Twister MT19937
// (Matsumoto and Nishimura, 1998), 53 bits a number, normal ones two by two (Box and Muller).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace twin {

class Chance {
 public:
  static constexpr int kWords = 624;
  // As random.Random.getstate() gives it: words and the place among them.
  using State = std::array<std::uint32_t, kWords + 1>;

  explicit Chance(const State& state) : state_(state) {}

  // Evenly from [0, 1).
  double number() {
    const std::uint32_t a = word() >> 5, b = word() >> 6;
    return (a * 67108864.0 + b) * (1.0 / 9007199254740992.0);
  }

  // Normal, mean 0 and deviation 1.
  double normal() {
    if (waits_) {
      waits_ = false;
      return 0.0 + waiting_;
    }
    const double turn = number() * kTurn;
    const double radius = std::sqrt(-2.0 * std::log(1.0 - number()));
    waiting_ = std::sin(turn) * radius;
    waits_ = true;
    return 0.0 + std::cos(turn) * radius;
  }

  // Evenly from 0 to count - 1; count below 2^8.
  std::uint32_t below(std::uint32_t count) {
    int bits = 0;
    while (count >> bits) ++bits;
    std::uint32_t drawn = word() >> (32 - bits);
    while (drawn >= count) drawn = word() >> (32 - bits);
    return drawn;
  }

 private:
  static constexpr double kTurn = 2.0 * 3.14159265358979323846;

  std::uint32_t word() {
    if (state_[kWords] >= kWords) renew();
    std::uint32_t y = state_[state_[kWords]++];
    y ^= y >> 11;
    y ^= (y << 7) & 0x9d2c5680u;
    y ^= (y << 15) & 0xefc60000u;
    return y ^ (y >> 18);
  }

  void renew() {
    const auto twisted = [this](int k, int next, int from) {
      const std::uint32_t y = (state_[k] & 0x80000000u) | (state_[next] & 0x7fffffffu);
      state_[k] = state_[from] ^ (y >> 1) ^ ((y & 1u) ? 0x9908b0dfu : 0u);
    };
    for (int k = 0; k < kWords; ++k) twisted(k, (k + 1) % kWords, (k + 397) % kWords);
    state_[kWords] = 0;
  }

  State state_;
  bool waits_ = false;  // the second of two normal numbers
  double waiting_ = 0.0;
};

}  // namespace twin
