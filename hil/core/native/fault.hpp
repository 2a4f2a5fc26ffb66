// What ends a run: hil.core.errors.RigFault as native code throws it.
#pragma once

#include <cstdio>
#include <stdexcept>
#include <string>

namespace core {

class RigFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// printf into a string; its formats give what Python's of the same name give.
template <typename... Values>
std::string words(const char* format, Values... values) {
  const int size = std::snprintf(nullptr, 0, format, values...);
  std::string out(static_cast<std::size_t>(size), '\0');
  std::snprintf(out.data(), out.size() + 1, format, values...);
  return out;
}

}  // namespace core
