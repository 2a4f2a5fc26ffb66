#include "params.h"

#include <math.h>
#include <string.h>

#include "crc32.h"
#include "flash.h"
#include "wheel_laws.h"

namespace hil {

namespace {

// Register of the CRC-32 after a name, which zeros fill up to its length.
template <uint16_t N>
constexpr uint32_t after_name(uint32_t state, const char (&name)[N], uint8_t from = 0) {
  return from == PARAM_NAME_LENGTH
             ? state
             : after_name(crc32_byte(state, static_cast<uint8_t>(from < N ? name[from] : 0)), name,
                          static_cast<uint8_t>(from + 1));
}

#define HIL_SPEC(name, value, low, high, live) {name, value, low, high, live, ~after_name(0xFFFFFFFFu, name)},
constexpr ParamSpec SPECS[PARAM_COUNT] HIL_FLASH = {
#define PARAM(name, field, value, low, high, unit, doc) HIL_SPEC(name, value, low, high, 0)
#define LIVE_PARAM(name, field, value, low, high, unit, doc) HIL_SPEC(name, value, low, high, 1)
#include "params.def"
#undef LIVE_PARAM
#undef PARAM
};

static_assert(sizeof(Params) == 4u * PARAM_COUNT, "parameters are 32-bit floats without padding");

void put(Params& params, uint8_t index, float value) {
  memcpy(reinterpret_cast<uint8_t*>(&params) + 4u * index, &value, 4);
}

bool in_range(const ParamSpec& spec, float value) {
  return isfinite(value) && value >= spec.low && value <= spec.high;
}

constexpr uint32_t after_names(uint32_t state, uint8_t from = 0) {
  return from == PARAM_COUNT
             ? state
             : after_names(after_name(state, SPECS[from].name), static_cast<uint8_t>(from + 1));
}
constexpr uint32_t NAMES_HASH = ~after_names(0xFFFFFFFFu);

void write_header(uint8_t* image, uint8_t serial) {
  const uint32_t names = NAMES_HASH;
  image[0] = 'H';
  image[1] = 'L';
  image[2] = IMAGE_VERSION;
  image[3] = serial;
  memcpy(image + 4, &names, 4);
}

bool is_blank(const uint8_t* image, uint16_t n) {
  for (uint16_t i = 0; i < n; ++i) {
    if (image[i] != 0xFF) return false;
  }
  return true;
}

bool is_sound(const uint8_t* image, uint16_t n) {
  if (n != IMAGE_SIZE) return false;
  uint8_t header[8];
  write_header(header, image_serial(image));
  uint32_t crc;
  memcpy(&crc, image + IMAGE_SIZE - 4, 4);
  return memcmp(header, image, sizeof(header)) == 0 && crc == crc32(0, image, IMAGE_SIZE - 4);
}

}  // namespace

ParamSpec param_spec(uint8_t index) { return flash_read(SPECS[index]); }

uint8_t param_find(const char* name) {
  for (uint8_t i = 0; i < PARAM_COUNT; ++i) {
    if (HIL_FLASH_STRNCMP(name, SPECS[i].name, PARAM_NAME_LENGTH) == 0) return i;
  }
  return PARAM_COUNT;
}

float param_get(const Params& params, uint8_t index) {
  float value;
  memcpy(&value, reinterpret_cast<const uint8_t*>(&params) + 4u * index, 4);
  return value;
}

ParamResult param_set(Params& params, uint8_t index, float value, bool armed) {
  if (index >= PARAM_COUNT) return ParamResult::UNKNOWN;
  const ParamSpec spec = param_spec(index);
  if (!isfinite(value)) return ParamResult::NOT_FINITE;
  if (!in_range(spec, value)) return ParamResult::OUT_OF_RANGE;
  if (armed && !spec.live) return ParamResult::FIXED_WHILE_ARMED;
  put(params, index, value + 0.0f);  // no negative zero: it would change the hash and nothing else
  return ParamResult::SET;
}

bool param_is(const Params& params, uint8_t index, float value) {
  const float asked = value + 0.0f;
  const float present = param_get(params, index);
  return memcmp(&asked, &present, 4) == 0;
}

void params_defaults(Params& params) {
  for (uint8_t i = 0; i < PARAM_COUNT; ++i) put(params, i, flash_read(SPECS[i].initial));
}

uint32_t param_hash_term(const Params& params, uint8_t index) {
  const float value = param_get(params, index);
  return crc32(flash_read(SPECS[index].name_crc), &value, 4);
}

uint32_t params_hash(const Params& params) {
  uint32_t sum = 0;
  for (uint8_t i = 0; i < PARAM_COUNT; ++i) sum += param_hash_term(params, i);
  return sum;
}

void params_encode(const Params& params, uint8_t serial, uint8_t (&image)[IMAGE_SIZE]) {
  write_header(image, serial);
  memcpy(image + 8, &params, sizeof(Params));
}

ImageResult params_decode(Params& params, const uint8_t* image, uint16_t n) {
  params_defaults(params);
  if (is_blank(image, n)) return ImageResult::BLANK;
  if (!is_sound(image, n)) return ImageResult::DAMAGED;
  Params stored;
  memcpy(&stored, image + 8, sizeof(Params));
  for (uint8_t i = 0; i < PARAM_COUNT; ++i) {
    if (!in_range(param_spec(i), param_get(stored, i))) return ImageResult::DAMAGED;
  }
  params = stored;
  return ImageResult::LOADED;
}

}  // namespace hil
