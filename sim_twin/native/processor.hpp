// What one core does at most, for `hil bench batch`: results that wait for each other, and operations side by side.
// Who calls takes the time.
#pragma once

#include <cstdint>

namespace twin {

// How an operation's results are chained, each the operand of the next.
enum Chain : int { kSums, kProducts, kQuotients, kRoots, kSines, kChains };

// Does so many operations, each of which waits for the one before; the last result, for nobody.
double chained(Chain chain, std::int64_t operations);

// Doubles that a register of this processor holds at most: 2, 4 or 8.
int widest_register();

// Does at least so many products and sums, or quotients, in registers of a width, independent of each other as far as
// ten registers go; returns how many. None where the processor does not have the width.
std::int64_t side_by_side(int width, std::int64_t operations, bool quotients);

}  // namespace twin
