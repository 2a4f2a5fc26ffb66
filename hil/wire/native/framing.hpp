// MAVLink 2 frames: cut out of a byte stream and checked; numbered and encoded. What the messages are made
// of comes from the generated dialect alone.
//
// Frame: FD, length, incompatible flags, compatible flags, sequence, system, component, message id
// (3 bytes), payload with trailing zeros cut off, CRC-16/MCRF4XX over all but FD, and CRC_EXTRA.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "core/wire.h"

namespace wire {

constexpr char kMarker = '\xfd';
constexpr std::size_t kHeader = 10, kOverhead = 12;  // header of ten bytes, and with the CRC
constexpr std::uint8_t kBoardSystem = 1, kBoardComponent = 1, kHostSystem = 255, kHostComponent = 190;

// CRC-16/MCRF4XX of some bytes and one more.
inline std::uint16_t checksum(std::string_view bytes, std::uint8_t extra) {
  std::uint16_t crc = 0xFFFF;
  const auto take = [&crc](std::uint8_t byte) {
    std::uint8_t x = byte ^ static_cast<std::uint8_t>(crc & 0xFF);
    x ^= static_cast<std::uint8_t>(x << 4);
    crc = static_cast<std::uint16_t>((crc >> 8) ^ (x << 8) ^ (x << 3) ^ (x >> 4));
  };
  for (const char c : bytes) take(static_cast<std::uint8_t>(c));
  take(extra);
  return crc;
}

// What the reader has met; `lost` counts gaps in the sequence numbers of the source.
struct ReadCounters {
  std::int64_t frames = 0, lost = 0, bad_crc = 0, skipped_bytes = 0, foreign = 0;
  std::int64_t signed_frames = 0;  // whose signature cannot be checked here, and which are not taken
};

inline std::uint32_t message_id(std::string_view frame) {
  const auto at = [&frame](std::size_t i) {
    return static_cast<std::uint32_t>(static_cast<std::uint8_t>(frame[i]));
  };
  return at(7) | at(8) << 8 | at(9) << 16;
}

// The payload of a frame as the dialect's struct; bytes that were cut off are zeros.
template <typename Message>
Message payload_of(std::string_view frame, std::size_t size) {
  Message out{};
  const std::size_t sent = frame.size() - kOverhead;
  std::memcpy(&out, frame.data() + kHeader, sent < size ? sent : size);
  return out;
}

// Cuts the frames of one source out of whatever bytes arrive, and finds back after damage.
//
// A damaged frame costs its marker byte only: the search goes on inside it, so that a good frame behind a
// false marker is not lost.
class FrameReader {
 public:
  explicit FrameReader(std::uint8_t system = kBoardSystem) : system_(system) {}

  // Calls take(frame) for each frame completed by `data`, in order; it must not call this again.
  template <typename Take>
  void feed(std::string_view data, Take take) {
    rest_.append(data);
    const std::string_view buffer = rest_;
    std::size_t start = 0;
    const Forget forget{rest_, start};  // whatever `take` throws, no frame is taken twice
    while (true) {
      const std::size_t marker = buffer.find(kMarker, start);
      if (marker == std::string_view::npos) {
        counters.skipped_bytes += static_cast<std::int64_t>(buffer.size() - start);
        start = buffer.size();
        return;
      }
      counters.skipped_bytes += static_cast<std::int64_t>(marker - start);
      start = marker;
      if (buffer.size() - start < kOverhead) return;
      const std::string_view head = buffer.substr(start);
      const mavlink_msg_entry_t* entry = mavlink_get_msg_entry(message_id(head));
      const std::size_t length = static_cast<std::uint8_t>(head[1]);
      if (entry == nullptr || length > entry->max_msg_len || head[2] != 0) {
        if (entry != nullptr && length <= entry->max_msg_len && head[2] == MAVLINK_IFLAG_SIGNED) {
          if (kOverhead + length > head.size()) return;
          counters.signed_frames += has_crc(head.substr(0, kOverhead + length), *entry);
        }
        skip(start);
        continue;
      }
      if (kOverhead + length > head.size()) return;
      const std::string_view frame = head.substr(0, kOverhead + length);
      if (!has_crc(frame, *entry)) {
        ++counters.bad_crc;
        skip(start);
        continue;
      }
      start += frame.size();
      if (is_ours(frame)) take(frame);
    }
  }

  ReadCounters counters;

 private:
  struct Forget {
    std::string& rest;
    const std::size_t& done;
    ~Forget() { rest.erase(0, done); }
  };

  static bool has_crc(std::string_view frame, const mavlink_msg_entry_t& entry) {
    const std::uint16_t sent = static_cast<std::uint16_t>(static_cast<std::uint8_t>(frame[frame.size() - 2]) |
                                                          static_cast<std::uint8_t>(frame.back()) << 8);
    return checksum(frame.substr(1, frame.size() - 3), entry.crc_extra) == sent;
  }
  void skip(std::size_t& start) {
    ++counters.skipped_bytes;
    ++start;
  }
  bool is_ours(std::string_view frame) {
    if (static_cast<std::uint8_t>(frame[5]) != system_) {
      ++counters.foreign;
      return false;
    }
    const std::uint8_t seq = static_cast<std::uint8_t>(frame[4]);
    const int gap = next_seq_ < 0 ? 0 : static_cast<std::uint8_t>(seq - next_seq_);
    counters.lost += gap < 128 ? gap : 0;  // a step back is a restart or a late frame
    next_seq_ = static_cast<std::uint8_t>(seq + 1);
    ++counters.frames;
    return true;
  }

  std::uint8_t system_;
  int next_seq_ = -1;
  std::string rest_;
};

// Numbers and encodes the frames of one source.
class FrameWriter {
 public:
  FrameWriter(std::uint8_t system, std::uint8_t component) : system_(system), component_(component) {}

  std::string setpoint(float left_rad_s, float right_rad_s, std::uint16_t seq) {
    mavlink_wheel_setpoint_t m{};
    m.omega_left_rad_s = left_rad_s;
    m.omega_right_rad_s = right_rad_s;
    m.seq = seq;
    return frame(m, MAVLINK_MSG_ID_WHEEL_SETPOINT, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN,
                 MAVLINK_MSG_ID_WHEEL_SETPOINT_CRC);
  }
  // The heartbeat of a ground station.
  std::string heartbeat() {
    mavlink_heartbeat_t m{};
    m.type = MAV_TYPE_GCS;
    m.autopilot = MAV_AUTOPILOT_INVALID;
    m.system_status = MAV_STATE_ACTIVE;
    m.mavlink_version = 3;
    return frame(m, MAVLINK_MSG_ID_HEARTBEAT, MAVLINK_MSG_ID_HEARTBEAT_LEN, MAVLINK_MSG_ID_HEARTBEAT_CRC);
  }
  std::string timesync(std::int64_t ts1_ns) {
    mavlink_timesync_t m{};
    m.ts1 = ts1_ns;
    return frame(m, MAVLINK_MSG_ID_TIMESYNC, MAVLINK_MSG_ID_TIMESYNC_LEN, MAVLINK_MSG_ID_TIMESYNC_CRC);
  }
  // What asks the board for the parameter with this index.
  std::string parameter_request(std::int16_t index) {
    mavlink_param_request_read_t m{};
    m.param_index = index;
    m.target_system = kBoardSystem;
    m.target_component = kBoardComponent;
    return frame(m, MAVLINK_MSG_ID_PARAM_REQUEST_READ, MAVLINK_MSG_ID_PARAM_REQUEST_READ_LEN,
                 MAVLINK_MSG_ID_PARAM_REQUEST_READ_CRC);
  }
  // Takes note that a frame was encoded with `seq` elsewhere.
  void count() { ++seq_; }
  std::uint8_t seq() const { return seq_; }

 private:
  template <typename Message>
  std::string frame(const Message& message, std::uint32_t id, std::size_t size, std::uint8_t crc_extra) {
    const char* payload = reinterpret_cast<const char*>(&message);
    while (size > 1 && payload[size - 1] == 0) --size;
    std::string out;
    out.reserve(kOverhead + size);
    for (const std::uint8_t byte :
         {std::uint8_t{0xFD}, static_cast<std::uint8_t>(size), std::uint8_t{0}, std::uint8_t{0}, seq_,
          system_, component_, static_cast<std::uint8_t>(id), static_cast<std::uint8_t>(id >> 8),
          static_cast<std::uint8_t>(id >> 16)}) {
      out.push_back(static_cast<char>(byte));
    }
    out.append(payload, size);
    const std::uint16_t crc = checksum(std::string_view(out).substr(1), crc_extra);
    out.push_back(static_cast<char>(crc & 0xFF));
    out.push_back(static_cast<char>(crc >> 8));
    ++seq_;
    return out;
  }

  std::uint8_t system_, component_, seq_ = 0;
};

}  // namespace wire
