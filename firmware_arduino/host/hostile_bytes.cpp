// Throws hostile bytes at the board: random, truncated, bit-flipped, oversized and replayed frames.
//   hostile_bytes FRAMES SEED
// Meant to be built with the address and undefined-behaviour sanitizers. Fails when the wheels move or
// the board arms without a true arming, when PWM leaves its range, or when the link does not recover.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmath>
#include <vector>

#include "core/board.h"

namespace {

using Bytes = std::vector<uint8_t>;

struct Random {
  uint64_t state;
  uint32_t next() {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return static_cast<uint32_t>(state >> 16);
  }
  uint32_t below(uint32_t n) { return next() % n; }
  float any_float() {
    const uint32_t bits = next();
    float value;
    memcpy(&value, &bits, 4);
    return value;
  }
};

[[noreturn]] void fail(const char* what) {
  fprintf(stderr, "hostile_bytes: %s\n", what);
  exit(1);
}

struct Host {
  mavlink_status_t status{};
  template <typename Encode>
  Bytes frame(Encode encode) {
    mavlink_message_t message;
    encode(&status, &message);
    uint8_t buffer[MAVLINK_MAX_PACKET_LEN];
    const uint16_t n = mavlink_msg_to_send_buffer(buffer, &message);
    return Bytes(buffer, buffer + n);
  }
  Bytes command(uint16_t id, float p1, float p3 = 0, float p4 = 0, float p5 = 0, float p6 = 0) {
    return frame([&](mavlink_status_t* st, mavlink_message_t* m) {
      mavlink_msg_command_long_pack_status(255, 190, st, m, 1, 1, id, 0, p1, 0, p3, p4, p5, p6, 0);
    });
  }
  Bytes setpoint(float left, float right, uint16_t seq) {
    return frame([&](mavlink_status_t* st, mavlink_message_t* m) {
      mavlink_msg_wheel_setpoint_pack_status(255, 190, st, m, left, right, seq);
    });
  }
  Bytes param_set(const char* name, float value) {
    return frame([&](mavlink_status_t* st, mavlink_message_t* m) {
      mavlink_msg_param_set_pack_status(255, 190, st, m, 1, 1, name, value, MAV_PARAM_TYPE_REAL32);
    });
  }
};

// The sender with the key: makes frames signed ones.
class Signing {
 public:
  explicit Signing(const uint8_t (&key)[hil::KEY_SIZE]) { hil::signer_set_key(signer_, key, 0); }

  Bytes sign(Bytes frame, hil::Stamp stamp) {
    uint16_t change = 0;
    crc_accumulate(MAVLINK_IFLAG_SIGNED, &change);
    for (size_t i = 3; i + 2 < frame.size() + 1; ++i) crc_accumulate(0, &change);
    frame[2] |= MAVLINK_IFLAG_SIGNED;
    frame[frame.size() - 2] ^= static_cast<uint8_t>(change);
    frame[frame.size() - 1] ^= static_cast<uint8_t>(change >> 8);
    frame.push_back(0);
    for (int i = 0; i < hil::STAMP_SIZE; ++i) frame.push_back(static_cast<uint8_t>(stamp >> 8 * i));
    memcpy(signer_.text, frame.data(), frame.size());
    hil::signer_begin(signer_, hil::HashJob::SIGN, static_cast<uint8_t>(frame.size()));
    uint8_t signature[hil::SIGNATURE_SIZE];
    while (!hil::signer_slice(signer_, signature)) {
    }
    frame.insert(frame.end(), signature, signature + hil::SIGNATURE_SIZE);
    return frame;
  }

 private:
  hil::Signer signer_{};
};

// A frame the board understands, with arguments that need not make sense.
Bytes plausible(Host& host, Random& rng) {
  switch (rng.below(6)) {
    case 0: return host.setpoint(rng.any_float(), rng.any_float(), static_cast<uint16_t>(rng.next()));
    case 1: return host.command(static_cast<uint16_t>(rng.next()), rng.any_float());
    case 2: return host.command(MAV_CMD_COMPONENT_ARM_DISARM, 1.0f, rng.any_float(), rng.any_float());
    case 3: return host.command(MAV_CMD_REQUEST_MESSAGE, rng.any_float());
    case 4: {
      const auto index = static_cast<uint8_t>(rng.below(hil::PARAM_COUNT));
      return host.param_set(hil::param_spec(index).name, rng.any_float());
    }
    default: return host.setpoint(1.0f, -1.0f, static_cast<uint16_t>(rng.next()));
  }
}

Bytes mutated(Bytes frame, Random& rng, const Bytes& replay) {
  const uint32_t place = rng.below(static_cast<uint32_t>(frame.size()));
  switch (rng.below(6)) {
    case 0:
      for (auto& byte : frame) byte = static_cast<uint8_t>(rng.next());
      break;
    case 1: frame.resize(place); break;
    case 2: frame[place] ^= static_cast<uint8_t>(1u << rng.below(8)); break;
    case 3:
      frame[1] = static_cast<uint8_t>(rng.next());
      frame.resize(280, 0xA5);
      break;
    case 4: return replay;
    default: break;
  }
  return frame;
}

class Rig {
 public:
  explicit Rig(uint64_t seed) : rng{seed * 2654435761u + 1u} { hil::board_init(board); }

  void feed(const Bytes& bytes) {
    const auto size = static_cast<uint16_t>(bytes.size());
    for (uint16_t at = 0; at < size;) {
      at = static_cast<uint16_t>(
          at + hil::board_receive(board, bytes.data() + at, static_cast<uint16_t>(size - at), t_us));
      hash_all();
    }
  }

  void hash_all() {
    while (hil::board_idle(board)) {
    }
  }

  void tick(int32_t left, int32_t right, uint16_t faults = 0) {
    hil::BoardOutputs out{};
    hil::board_tick(board, {t_us, left, right, faults, 12000}, out);
    hil::StoredByte byte;
    hil::board_store(board, byte);
    hil::board_slack(board);
    hash_all();
    t_us += hil::TICK_US;
    const bool armed = board.safety.state == HIL_STATE_ARMED;
    if (!armed && (out.pwm_left != 0 || out.pwm_right != 0)) fail("wheels driven while not armed");
    for (const int16_t pwm : {out.pwm_left, out.pwm_right}) {
      if (pwm > hil::PWM_TOP || pwm < -hil::PWM_TOP) fail("PWM out of range");
    }
  }

  void tick_anyhow() {
    const auto left = static_cast<int32_t>(rng.next());
    const auto right = static_cast<int32_t>(rng.next());
    tick(left, right, static_cast<uint16_t>(rng.next()));
  }

  // True when the board answers a request for its identity within a second.
  bool recovers() {
    mavlink_message_t rx{};
    mavlink_status_t status{};
    for (int i = 0; i < 250; ++i) {
      if (i % 8 == 0) feed(host.command(MAV_CMD_REQUEST_MESSAGE, MAVLINK_MSG_ID_BOARD_INFO));
      tick(0, 0);
      uint8_t out[256];
      const uint16_t n = hil::board_transmit(board, out, sizeof(out));
      for (uint16_t k = 0; k < n; ++k) {
        if (mavlink_frame_char_buffer(&rx, &status, out[k], nullptr, nullptr) == MAVLINK_FRAMING_OK &&
            rx.msgid == MAVLINK_MSG_ID_BOARD_INFO) {
          return true;
        }
      }
    }
    return false;
  }

  Bytes arming() {
    const uint32_t d = board.dialect_hash, p = board.parameter_hash;
    return host.command(MAV_CMD_COMPONENT_ARM_DISARM, 1.0f, static_cast<float>(d >> 16),
                        static_cast<float>(d & 0xFFFFu), static_cast<float>(p >> 16),
                        static_cast<float>(p & 0xFFFFu));
  }

  void arm() {
    hil::params_defaults(board.params);
    board.parameter_hash = hil::params_hash(board.params);
    feed(arming());
  }

  Random rng;
  Host host;
  hil::Board board;
  uint32_t t_us = 0xFFFFF000u;  // the clock wraps at once
};

// Hostile traffic to a board that nobody arms.
void unarmed(uint32_t frames, uint64_t seed) {
  Rig rig(seed);
  Bytes replay = plausible(rig.host, rig.rng);
  for (uint32_t i = 0; i < frames; ++i) {
    const Bytes frame = plausible(rig.host, rig.rng);
    rig.feed(mutated(frame, rig.rng, replay));
    if (rig.rng.below(16) == 0) replay = frame;
    if (i % 4 == 0) rig.tick_anyhow();
    if (rig.board.safety.state == HIL_STATE_ARMED) fail("armed without a true arming");
    if (i % 5000 == 4999 && !rig.recovers()) fail("link did not recover within a heartbeat");
  }
}

// Hostile traffic, encoders and live parameters while armed; armed anew whenever the board has stopped.
void armed(uint32_t frames, uint64_t seed) {
  Rig rig(seed);
  uint16_t seq = 0;
  int32_t counts = 0;
  uint32_t armed_ticks = 0;
  for (uint32_t i = 0; i < frames; ++i) {
    if (rig.board.safety.state != HIL_STATE_ARMED) rig.arm();
    const float wanted = 15.0f * std::sin(0.01f * static_cast<float>(i));
    rig.feed(rig.host.setpoint(wanted, wanted, ++seq));
    const Bytes frame = plausible(rig.host, rig.rng);
    rig.feed(mutated(frame, rig.rng, frame));
    counts += rig.board.wheel[hil::LEFT].pwm / 32;  // a wheel of sorts, now and then a false count
    if (rig.rng.below(500) == 0) counts += static_cast<int32_t>(rig.rng.below(400));
    rig.tick(counts, counts);
    armed_ticks += rig.board.safety.state == HIL_STATE_ARMED;
  }
  if (frames >= 1000 && armed_ticks < frames / 20) fail("hardly ever armed: the test tests nothing");
}

// A board with a key, driven by a host that has it, among frames without signatures, with another key's, with
// bits turned, and heard before: nothing but what the host has signed is in force, ever.
void keyed(uint32_t frames, uint64_t seed) {
  uint8_t key[hil::KEY_SIZE], other[hil::KEY_SIZE];
  Rig rig(seed);
  for (uint8_t i = 0; i < hil::KEY_SIZE; ++i) {
    key[i] = static_cast<uint8_t>(rig.rng.next());
    other[i] = static_cast<uint8_t>(rig.rng.next());
  }
  Signing good(key), bad(other);
  hil::signer_set_key(rig.board.link.signer, key, 0);
  for (int i = 0; i < 200; ++i) rig.tick(0, 0);
  const uint32_t parameters = hil::params_hash(rig.board.params);
  const auto now = [&rig] { return rig.board.link.signer.now + 1; };
  uint16_t seq = 0;
  int32_t counts = 0;
  uint32_t armed_ticks = 0;
  Bytes heard = good.sign(rig.host.setpoint(9.0f, 9.0f, 1), now());
  rig.feed(heard);
  for (uint32_t i = 0; i < frames; ++i) {
    if (rig.board.safety.state != HIL_STATE_ARMED) rig.feed(good.sign(rig.arming(), now()));
    rig.feed(good.sign(rig.host.setpoint(1.0f, 1.0f, ++seq), now()));
    const Bytes plain = plausible(rig.host, rig.rng);
    Bytes forged = plain;
    if (rig.rng.below(2) == 0) forged = bad.sign(plain, now());
    if (rig.rng.below(4) == 0) {
      forged = good.sign(plain, now());
      const uint32_t place = 1 + rig.rng.below(static_cast<uint32_t>(forged.size()) - 1);
      forged[place] ^= static_cast<uint8_t>(1u << rig.rng.below(8));
      rig.feed(forged);
    } else {
      rig.feed(mutated(forged, rig.rng, heard));
    }
    counts += rig.board.wheel[hil::LEFT].pwm / 64;
    rig.tick(counts, counts);
    const hil::Setpoint& now_set = rig.board.setpoint;
    for (const float speed : now_set.omega_rad_s) {
      if (speed != 1.0f && speed != 0.0f) fail("a set-point that was not signed is in force");
    }
    if (hil::params_hash(rig.board.params) != parameters) fail("a parameter was set without a signature");
    if (rig.board.link.signer.mode != hil::Signing::ON) fail("the key is gone");
    armed_ticks += rig.board.safety.state == HIL_STATE_ARMED;
  }
  if (frames >= 1000 && armed_ticks < frames / 20)
    fail("hardly ever armed with a key: the test tests nothing");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) fail("usage: hostile_bytes FRAMES SEED");
  const uint32_t frames = static_cast<uint32_t>(strtoul(argv[1], nullptr, 10));
  const uint64_t seed = strtoull(argv[2], nullptr, 10);
  unarmed(frames, seed);
  armed(frames, seed + 1);
  keyed(frames / 4, seed + 2);
  printf("%u frames unarmed, %u armed, %u with a key: no fault\n", frames, frames, frames / 4);
  return 0;
}
