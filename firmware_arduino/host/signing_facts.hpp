// What tests ask of the core's signing without a board: digests, and what an EEPROM holds.
#pragma once

#include <nanobind/nanobind.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/board.h"

namespace nb = nanobind;

inline std::uint8_t const* data_of(const nb::bytes& bytes) {
  return reinterpret_cast<const std::uint8_t*>(bytes.c_str());
}

// Digest of the core's SHA-256 over any bytes.
inline nb::bytes sha256(const nb::bytes& data) {
  std::vector<uint8_t> text(data_of(data), data_of(data) + data.size());
  text.push_back(0x80);
  while (text.size() % hil::SHA_BLOCK != hil::SHA_BLOCK - 8) text.push_back(0);
  for (int shift = 56; shift >= 0; shift -= 8) {
    text.push_back(static_cast<uint8_t>(static_cast<std::uint64_t>(data.size()) * 8 >> shift));
  }
  hil::Sha256 sha;
  hil::sha256_init(sha);
  for (std::size_t at = 0; at < text.size(); at += hil::SHA_BLOCK) {
    hil::sha256_words(sha, 0, text.data() + at, 16);
    hil::sha256_begin(sha);
    while (!hil::sha256_slice(sha)) {
    }
  }
  std::string digest;
  for (const uint32_t word : sha.h) {
    for (int shift = 24; shift >= 0; shift -= 8) digest.push_back(static_cast<char>(word >> shift & 0xFF));
  }
  return nb::bytes(digest.data(), digest.size());
}

// What the EEPROM of a board holds that was given this key at `stamp`, and nothing else.
inline nb::bytes stored_key(const nb::bytes& key, std::uint64_t stamp) {
  if (key.size() != hil::KEY_SIZE) throw nb::value_error("a key has 32 bytes");
  std::string storage(hil::BOARD_STORAGE_SIZE, '\xFF');
  hil::Signer signer{};
  hil::signer_set_key(signer, data_of(key), stamp);
  for (int ticks = 0; ticks < 2; ++ticks) {
    hil::StoredByte byte{};
    while (hil::signer_store(signer, byte)) storage[byte.address] = static_cast<char>(byte.value);
    hil::signer_tick(signer);
  }
  return nb::bytes(storage.data(), storage.size());
}
