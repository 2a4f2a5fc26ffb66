// Parameters: values in RAM, their names and bounds in flash, one declaration in params.def.
#ifndef HIL_CORE_PARAMS_H
#define HIL_CORE_PARAMS_H

#include <stdint.h>

namespace hil {

constexpr uint8_t PARAM_NAME_LENGTH = 16;

struct Params {
#define PARAM(name, field, value, low, high, unit, doc) float field;
#define LIVE_PARAM PARAM
#include "params.def"
#undef LIVE_PARAM
#undef PARAM
};

constexpr uint8_t PARAM_COUNT = sizeof(Params) / sizeof(float);

struct ParamSpec {
  char name[PARAM_NAME_LENGTH];  // zero-padded
  float initial;
  float low;
  float high;
  uint8_t live;       // 1: may change while armed
  uint32_t name_crc;  // CRC-32 over `name`
};

enum class ParamResult : uint8_t { SET, UNKNOWN, NOT_FINITE, OUT_OF_RANGE, FIXED_WHILE_ARMED };

ParamSpec param_spec(uint8_t index);
// Index of a name that is zero-terminated or exactly 16 long; PARAM_COUNT when unknown.
uint8_t param_find(const char* name);
float param_get(const Params& params, uint8_t index);
// Sets a value after every check; `params` is left alone unless the result is SET.
ParamResult param_set(Params& params, uint8_t index, float value, bool armed);
// True when the parameter has this value, to the bit (0 and -0 are one value here).
bool param_is(const Params& params, uint8_t index, float value);
void params_defaults(Params& params);

// Sum modulo 2^32 over all parameters of CRC-32(name[16], value as float32 little-endian). Over values,
// so that equal hashes mean equal gains; a sum, so that a host needs no order and the board can follow
// one change at the cost of one parameter.
uint32_t params_hash(const Params& params);
uint32_t param_hash_term(const Params& params, uint8_t index);

// Storage image: 'H' 'L' version serial, CRC-32 over all names, values, CRC-32 over all before it. Of two
// images the one with the newer serial counts, in circular order.
constexpr uint8_t IMAGE_VERSION = 1;
constexpr uint16_t IMAGE_SIZE = 8 + sizeof(Params) + 4;
enum class ImageResult : uint8_t { LOADED, BLANK, DAMAGED };
// Writes all but the CRC at the end, which whoever hands the bytes out works out as they go.
void params_encode(const Params& params, uint8_t serial, uint8_t (&image)[IMAGE_SIZE]);
// Takes the image whole or not at all: anything but LOADED leaves the defaults in `params`.
ImageResult params_decode(Params& params, const uint8_t* image, uint16_t n);
inline uint8_t image_serial(const uint8_t* image) { return image[3]; }

}  // namespace hil

#endif
