// The wheel laws by number, as the parameter LAW has it.
#ifndef HIL_CORE_WHEEL_LAWS_H
#define HIL_CORE_WHEEL_LAWS_H

#include <stdint.h>

#include "laws.def"

namespace hil {

enum class Law : uint8_t {
#define WHEEL_LAW(ID, files, name, doc) ID,
#include "laws.def"
#undef WHEEL_LAW
};

#define WHEEL_LAW(ID, files, name, doc) +1
constexpr float LAST_WHEEL_LAW = static_cast<float>(0
#include "laws.def"
                                                    - 1);
#undef WHEEL_LAW

}  // namespace hil

#endif
