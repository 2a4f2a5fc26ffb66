// Parameters on their way to storage and back: two images, written in turn, so that a save cut short leaves
// the one before. A byte a call, so that nothing waits for the storage.
#ifndef HIL_CORE_SAVE_H
#define HIL_CORE_SAVE_H

#include <stdint.h>

#include "params.h"

namespace hil {

constexpr uint8_t SLOTS = 2;
constexpr uint16_t SLOT_SIZE = 256;  // an image and room for more parameters
constexpr uint16_t STORAGE_SIZE = SLOTS * SLOT_SIZE;
static_assert(IMAGE_SIZE <= SLOT_SIZE, "an image fits into its slot");

struct StoredByte {
  uint16_t address;
  uint8_t value;
};

struct Save {
  uint8_t image[IMAGE_SIZE];
  uint32_t crc;    // over what has been handed out
  uint16_t next;   // byte to hand out
  uint8_t slot;    // that the next save goes to, or this one does
  uint8_t serial;  // of the image in force
  bool running;
  bool wanted;  // a save is to begin when none is running
};

// Copies n bytes of the storage from `address` on; `storage` is the caller's.
using StorageRead = void (*)(void* storage, uint16_t address, uint8_t* out, uint16_t n);

struct Stored {
  ImageResult result;
  bool older;  // the other image is damaged: a save was cut short
};

// Takes the newer of the sound images into `params`, the defaults when there is none.
Stored save_load(Save& s, Params& params, StorageRead read, void* storage);

// Starts a save of these parameters.
void save_begin(Save& s, const Params& params);
// True while there is a byte to be written, which `out` then is; false when all are.
bool save_next(Save& s, StoredByte& out);
// Every byte has been written: this image is now the one in force.
void save_end(Save& s);

}  // namespace hil

#endif
