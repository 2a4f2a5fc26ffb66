#include "storage.h"

#include <avr/eeprom.h>

namespace hil {
namespace storage {
namespace {

uint8_t* place(uint16_t address) { return reinterpret_cast<uint8_t*>(address); }

void read(void*, uint16_t address, uint8_t* out, uint16_t n) { eeprom_read_block(out, place(address), n); }

}  // namespace

void load(Board& board) { board_load(board, read, nullptr); }

void tick(Board& board) {
  StoredByte byte;
  if (eeprom_is_ready() && board_store(board, byte)) eeprom_update_byte(place(byte.address), byte.value);
}

}  // namespace storage
}  // namespace hil
