#include "save.h"

#include <string.h>

#include "crc32.h"

namespace hil {

namespace {

constexpr uint16_t CRC_AT = IMAGE_SIZE - 4;

ImageResult read_slot(Save& s, Params& params, uint8_t slot, StorageRead read, void* storage) {
  read(storage, static_cast<uint16_t>(slot * SLOT_SIZE), s.image, IMAGE_SIZE);
  return params_decode(params, s.image, IMAGE_SIZE);
}

bool is_newer(uint8_t serial, uint8_t than) {
  return static_cast<int8_t>(static_cast<uint8_t>(serial - than)) > 0;
}

}  // namespace

Stored save_load(Save& s, Params& params, StorageRead read, void* storage) {
  const ImageResult first = read_slot(s, params, 0, read, storage);
  const uint8_t first_serial = image_serial(s.image);
  const ImageResult second = read_slot(s, params, 1, read, storage);
  const bool both = first == ImageResult::LOADED && second == ImageResult::LOADED;
  const bool any = first == ImageResult::LOADED || second == ImageResult::LOADED;
  const bool damaged = first == ImageResult::DAMAGED || second == ImageResult::DAMAGED;
  if (!any) return {damaged ? ImageResult::DAMAGED : ImageResult::BLANK, false};
  const bool use_second =
      both ? is_newer(image_serial(s.image), first_serial) : second == ImageResult::LOADED;
  if (!use_second) read_slot(s, params, 0, read, storage);
  s.serial = image_serial(s.image);
  s.slot = use_second ? 0 : 1;
  return {ImageResult::LOADED, damaged};
}

void save_begin(Save& s, const Params& params) {
  params_encode(params, static_cast<uint8_t>(s.serial + 1u), s.image);
  s.crc = 0;
  s.next = 0;
  s.running = true;
  s.wanted = false;
}

bool save_next(Save& s, StoredByte& out) {
  if (s.next >= IMAGE_SIZE) return false;
  if (s.next == CRC_AT) memcpy(s.image + CRC_AT, &s.crc, 4);
  const uint8_t byte = s.image[s.next];
  if (s.next < CRC_AT) s.crc = crc32(s.crc, &byte, 1);
  out = {static_cast<uint16_t>(s.slot * SLOT_SIZE + s.next), byte};
  ++s.next;
  return true;
}

void save_end(Save& s) {
  s.running = false;
  ++s.serial;
  s.slot = static_cast<uint8_t>(1u - s.slot);
}

}  // namespace hil
