#include "storage.h"

#include <avr/eeprom.h>

namespace hil {
namespace storage {
namespace {

uint8_t g_image[IMAGE_SIZE];
uint16_t g_next = IMAGE_SIZE;  // byte to write; IMAGE_SIZE: no save is running

uint8_t* address(uint16_t index) { return reinterpret_cast<uint8_t*>(index); }

}  // namespace

void load(Board& board) {
  eeprom_read_block(g_image, address(0), IMAGE_SIZE);
  board_load(board, g_image, IMAGE_SIZE);
}

void tick(Board& board) {
  if (g_next < IMAGE_SIZE) {
    if (!eeprom_is_ready()) return;
    eeprom_update_byte(address(g_next), g_image[g_next]);
    ++g_next;
  } else if (board_store(board, g_image)) {
    g_next = 0;
  }
}

}  // namespace storage
}  // namespace hil
