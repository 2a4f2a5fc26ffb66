#include "processor.hpp"

#include <cmath>

namespace twin {
namespace {

constexpr int kRegisters = 10;  // enough for the waits of two operations, and few enough to stay registers

#define PROCESSOR_INLINE inline __attribute__((always_inline))

// A value that the compiler does not know.
PROCESSOR_INLINE double unknown(double value) {
  volatile double kept = value;
  return kept;
}

using Two = double __attribute__((vector_size(16)));
using Four = double __attribute__((vector_size(32)));
using Eight = double __attribute__((vector_size(64)));

template <typename Wide>
PROCESSOR_INLINE std::int64_t work(std::int64_t operations, bool quotients) {
  constexpr int Width = sizeof(Wide) / sizeof(double);
  Wide value[kRegisters];
  const Wide factor = unknown(0.999) + Wide{}, term = unknown(0.001) + Wide{};
  for (int i = 0; i < kRegisters; ++i) value[i] = unknown(1.0 + 0.1 * i) + Wide{};
  const std::int64_t each = (quotients ? 1 : 2) * kRegisters * Width;
  const std::int64_t rounds = (operations + each - 1) / each;
  for (std::int64_t round = 0; round < rounds && !quotients; ++round) {
#pragma GCC unroll 10
    for (int i = 0; i < kRegisters; ++i) value[i] = value[i] * factor + term;
  }
  for (std::int64_t round = 0; round < rounds && quotients; ++round) {
#pragma GCC unroll 10
    for (int i = 0; i < kRegisters; ++i) value[i] = factor / value[i];
  }
  Wide sum{};
  for (int i = 0; i < kRegisters; ++i) sum += value[i];
  unknown(sum[0]);
  return rounds * each;
}

#if defined(__x86_64__) && defined(__GNUC__)
#define PROCESSOR_X86
__attribute__((target("avx2"))) std::int64_t four(std::int64_t operations, bool quotients) {
  return work<Four>(operations, quotients);
}
__attribute__((target("avx512f"))) std::int64_t eight(std::int64_t operations, bool quotients) {
  return work<Eight>(operations, quotients);
}
#endif

template <typename Operation>
double repeated(std::int64_t operations, double value, Operation operation) {
  for (std::int64_t i = 0; i < operations; ++i) value = operation(value);
  return unknown(value);
}

}  // namespace

double chained(Chain chain, std::int64_t operations) {
  const double one = unknown(1.0), near_one = unknown(0.9999999), small = unknown(1e-9);
  switch (chain) {
    case kSums: return repeated(operations, one, [small](double v) { return v + small; });
    case kProducts: return repeated(operations, one, [near_one](double v) { return v * near_one; });
    case kQuotients: return repeated(operations, one, [near_one](double v) { return near_one / v; });
    case kRoots: return repeated(operations, unknown(7.0), [](double v) { return std::sqrt(v); });
    default: return repeated(operations, one, [](double v) { return std::cos(v); });
  }
}

int widest_register() {
#ifdef PROCESSOR_X86
  if (__builtin_cpu_supports("avx512f")) return 8;
  if (__builtin_cpu_supports("avx2")) return 4;
#endif
  return 2;
}

std::int64_t side_by_side(int width, std::int64_t operations, bool quotients) {
  if (width == 2) return work<Two>(operations, quotients);
#ifdef PROCESSOR_X86
  if (width == 4 && widest_register() >= 4) return four(operations, quotients);
  if (width == 8 && widest_register() >= 8) return eight(operations, quotients);
#endif
  return 0;
}

}  // namespace twin
