#include "report.h"

#include <string.h>

#include "flash.h"

#ifndef HIL_BUILD_ID
#define HIL_BUILD_ID "unnamed"
#endif

namespace hil {

namespace {

constexpr uint8_t SECOND_TICKS = 250;
constexpr uint8_t WHEEL_STATE_EVERY = 5;
constexpr uint8_t PARAM_EVERY = 25;
constexpr uint8_t TEXT_EVERY = 50;
constexpr uint8_t TEXT_LENGTH = 50;

struct TextEntry {
  uint8_t severity;
  char text[TEXT_LENGTH];
};

constexpr TextEntry TEXTS[] HIL_FLASH = {
#define TEXT(name, severity, text) {severity, text},
#include "texts.def"
#undef TEXT
};

static_assert(static_cast<uint8_t>(Text::COUNT) <= 8 * TEXT_BYTES, "one bit per text");
static_assert(sizeof(HIL_BUILD_ID) <= 9, "eight characters of build id");

// Packs a message of the dialect and queues it behind room for a wheel state.
#define HIL_SEND(b, name, fields)                                                                       \
  do {                                                                                                  \
    mavlink_message_t message;                                                                          \
    mavlink_msg_##name##_encode_status(BOARD_SYSTEM_ID, BOARD_COMPONENT_ID, &(b).link.status, &message, \
                                       &(fields));                                                      \
    link_send((b).link, message, WHEEL_STATE_ROOM);                                                     \
  } while (false)

uint8_t wheel_flags(const Board& b) {
  uint8_t flags = 0;
  if (b.wheel[LEFT].saturation != 0) flags |= HIL_WHEEL_FLAG_SATURATED_LEFT;
  if (b.wheel[RIGHT].saturation != 0) flags |= HIL_WHEEL_FLAG_SATURATED_RIGHT;
  if (b.wheel[LEFT].holding) flags |= HIL_WHEEL_FLAG_HOLD_LEFT;
  if (b.wheel[RIGHT].holding) flags |= HIL_WHEEL_FLAG_HOLD_RIGHT;
  if (b.tuning.law == Law::PID) flags |= HIL_WHEEL_FLAG_PID;
  if (b.safety.battery_low) flags |= HIL_WHEEL_FLAG_BATTERY_LOW;
  return flags;
}

void send_wheel_state(Board& b) {
  const Wheel& left = b.wheel[LEFT];
  const Wheel& right = b.wheel[RIGHT];
  mavlink_wheel_state_t m;
  m.t_mcu_us = b.inputs.t_us;
  m.left_counts = b.inputs.counts_left;
  m.right_counts = b.inputs.counts_right;
  m.omega_left_rad_s = left.omega_rad_s;
  m.omega_right_rad_s = right.omega_rad_s;
  m.error_rate_left_rad_s2 = left.error_rate_rad_s2;
  m.error_rate_right_rad_s2 = right.error_rate_rad_s2;
  m.s_left = wheel_sliding(left, b.tuning);
  m.s_right = wheel_sliding(right, b.tuning);
  m.t_setpoint_us = b.setpoint.t_us;
  m.pwm_left_counts = left.pwm;
  m.pwm_right_counts = right.pwm;
  m.setpoint_seq = b.setpoint.seq;
  m.state = b.safety.state;
  m.reason = b.safety.reason;
  m.flags = wheel_flags(b);
  mavlink_message_t message;
  mavlink_msg_wheel_state_encode_status(BOARD_SYSTEM_ID, BOARD_COMPONENT_ID, &b.link.status, &message, &m);
  link_send(b.link, message, 0);
}

uint8_t bit_of(uint8_t index) { return static_cast<uint8_t>(1u << (index & 7u)); }

bool has_bit(const uint8_t (&set)[TEXT_BYTES], uint8_t index) {
  return (set[index >> 3] & bit_of(index)) != 0;
}

void send_text(Board& b) {
  uint8_t index = 0;
  while (!has_bit(b.texts_waiting, index)) {
    if (++index == static_cast<uint8_t>(Text::COUNT)) return;
  }
  b.texts_waiting[index >> 3] &= static_cast<uint8_t>(~bit_of(index));
  const TextEntry entry = flash_read(TEXTS[index]);
  mavlink_statustext_t m;
  memset(&m, 0, sizeof(m));
  m.severity = entry.severity;
  memcpy(m.text, entry.text, sizeof(m.text));
  HIL_SEND(b, statustext, m);
}

uint8_t system_status(const Board& b) {
  if (b.safety.state == HIL_STATE_ARMED) return MAV_STATE_ACTIVE;
  return b.safety.state == HIL_STATE_SAFE ? MAV_STATE_CRITICAL : MAV_STATE_STANDBY;
}

// Share of the host's frames lost on the way, in hundredths of a percent.
uint16_t loss_share(const Link& link) {
  uint32_t lost = link.lost;
  uint32_t all = lost + link.received;
  if (all == 0) return 0;
  for (; lost > UINT32_MAX / 10000u; lost >>= 1) all >>= 1;  // the product fits; a share needs no more
  return static_cast<uint16_t>(10000u * lost / all);
}

uint16_t in_16_bits(uint32_t count) { return count < UINT16_MAX ? static_cast<uint16_t>(count) : UINT16_MAX; }

}  // namespace

void say(Board& b, Text text) {
  const uint8_t index = static_cast<uint8_t>(text);
  if (has_bit(b.texts_sent, index)) return;
  b.texts_sent[index >> 3] |= bit_of(index);
  b.texts_waiting[index >> 3] |= bit_of(index);
}

void say_state(Board& b) {
  if (b.safety.state == HIL_STATE_ARMED) {
    say(b, Text::ARMED);
  } else if (b.safety.state == HIL_STATE_DISARMED) {
    say(b, Text::DISARMED);
  } else {
    say(b, static_cast<Text>(static_cast<uint8_t>(b.safety.reason - HIL_REASON_STOP_COMMAND)));
  }
}

void send_heartbeat(Board& b) {
  mavlink_heartbeat_t m;
  memset(&m, 0, sizeof(m));
  m.type = MAV_TYPE_GROUND_ROVER;
  m.autopilot = MAV_AUTOPILOT_GENERIC;
  m.base_mode = MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
  if (b.safety.state == HIL_STATE_ARMED) m.base_mode |= MAV_MODE_FLAG_SAFETY_ARMED;
  m.custom_mode = static_cast<uint32_t>(b.safety.reason) << 8 | b.safety.state;
  m.system_status = system_status(b);
  HIL_SEND(b, heartbeat, m);
}

void send_sys_status(Board& b) {
  constexpr uint32_t MOTORS = MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS;
  constexpr uint32_t BATTERY = MAV_SYS_STATUS_SENSOR_BATTERY;
  mavlink_sys_status_t m;
  memset(&m, 0, sizeof(m));
  m.onboard_control_sensors_present = MOTORS | BATTERY;
  m.onboard_control_sensors_enabled = BATTERY;
  if (b.safety.state == HIL_STATE_ARMED) m.onboard_control_sensors_enabled |= MOTORS;
  if (b.safety.state != HIL_STATE_SAFE) m.onboard_control_sensors_health |= MOTORS;
  if (!b.safety.battery_low) m.onboard_control_sensors_health |= BATTERY;
  m.load = b.load_permille;
  m.voltage_battery = b.inputs.battery_mv;
  m.current_battery = -1;
  m.battery_remaining = -1;
  m.drop_rate_comm = loss_share(b.link);
  m.errors_comm = b.link.bad;
  m.errors_count1 = b.overruns;
  m.errors_count2 = in_16_bits(b.link.lost);
  m.errors_count3 = b.link.dropped;
  m.errors_count4 = b.refused;
  HIL_SEND(b, sys_status, m);
}

void send_board_info(Board& b) {
  mavlink_board_info_t m;
  memset(&m, 0, sizeof(m));
  m.dialect_hash = b.dialect_hash;
  m.parameter_hash = b.parameter_hash;
  m.pwm_top_counts = PWM_TOP;
  m.tick_us = TICK_US;
  memcpy(m.build_id, HIL_BUILD_ID, sizeof(HIL_BUILD_ID) - 1);
  HIL_SEND(b, board_info, m);
}

void send_param(Board& b, uint8_t index) {
  mavlink_param_value_t m;
  memcpy(m.param_id, param_spec(index).name, sizeof(m.param_id));
  m.param_value = param_get(b.params, index);
  m.param_type = MAV_PARAM_TYPE_REAL32;
  m.param_count = PARAM_COUNT;
  m.param_index = index;
  HIL_SEND(b, param_value, m);
}

void report_tick(Board& b) {
  const uint8_t slot = b.slot;
  b.slot = static_cast<uint8_t>(slot + 1u < SECOND_TICKS ? slot + 1u : 0u);
  if (slot % WHEEL_STATE_EVERY == 0) send_wheel_state(b);
  if (slot % PARAM_EVERY == 1 && b.params_next < PARAM_COUNT) send_param(b, b.params_next++);
  if (slot % TEXT_EVERY == 2) send_text(b);
  if (slot == 3) send_heartbeat(b);
  if (slot == 4) memcpy(b.texts_sent, b.texts_waiting, TEXT_BYTES);
  if (slot == 8) send_sys_status(b);
}

}  // namespace hil
