#include "protocol.h"

#include <math.h>
#include <string.h>

#include "report.h"

namespace hil {

namespace {

bool is_for_us(uint8_t system, uint8_t component) {
  return (system == 0 || system == BOARD_SYSTEM_ID) && (component == 0 || component == BOARD_COMPONENT_ID);
}

// A retune while armed starts the wheel law anew, so there are ten a second at most.
constexpr uint8_t RETUNE_TICKS = 25;

uint8_t refuse(Board& b, Text why, uint8_t result) {
  say(b, why);
  return result;
}

// True when two floats carry the upper and lower half of `hash`.
bool carries(uint32_t hash, float upper, float lower) {
  return upper == static_cast<float>(static_cast<uint16_t>(hash >> 16)) &&
         lower == static_cast<float>(static_cast<uint16_t>(hash));
}

bool wheels_turn(const Board& b) {
  constexpr float AT_REST_RAD_S = 1.0f;
  return fabsf(b.wheel[LEFT].omega_rad_s) > AT_REST_RAD_S ||
         fabsf(b.wheel[RIGHT].omega_rad_s) > AT_REST_RAD_S;
}

// Which hash of an arming is not the board's; Text::COUNT when both are.
Text foreign_hash(const Board& b, const mavlink_command_long_t& m) {
  if (!carries(b.dialect_hash, m.param3, m.param4)) return Text::ARM_DIALECT;
  return carries(b.parameter_hash, m.param5, m.param6) ? Text::COUNT : Text::ARM_PARAMETERS;
}

// What of the board's state speaks against arming; Text::COUNT when nothing does.
Text bar_to_arming(const Board& b) {
  if (b.limits.edges_too_fast) return Text::ARM_EDGES;
  if (!b.ticked) return Text::ARM_NO_TICK;
  if (b.safety.battery_low) return Text::ARM_BATTERY;
  if (b.safety.encoder_fault) return Text::ARM_ENCODER;
  if (b.safety.standing != 0 || wheels_turn(b)) return Text::ARM_TURNING;
  return Text::COUNT;
}

uint8_t arm(Board& b, const mavlink_command_long_t& m, uint32_t t_us) {
  const Text foreign = foreign_hash(b, m);
  if (foreign != Text::COUNT) return refuse(b, foreign, MAV_RESULT_TEMPORARILY_REJECTED);
  if (b.safety.state == HIL_STATE_ARMED) return MAV_RESULT_ACCEPTED;  // a repeat: nothing restarts
  if (b.retune_due) protocol_retune(b);
  const Text bar = bar_to_arming(b);
  if (bar != Text::COUNT) return refuse(b, bar, MAV_RESULT_TEMPORARILY_REJECTED);
  if (!safety_apply(b.safety, WANTS_ARM)) return MAV_RESULT_FAILED;
  b.setpoint = Setpoint{};
  b.setpoint.t_us = t_us;  // the time-out runs from arming
  wheel_off(b.wheel[LEFT]);
  wheel_off(b.wheel[RIGHT]);
  say_state(b);
  return MAV_RESULT_ACCEPTED;
}

uint8_t ask(Board& b, Conditions conditions) {
  if (safety_apply(b.safety, conditions)) say_state(b);
  return MAV_RESULT_ACCEPTED;
}

uint8_t on_arm_disarm(Board& b, const mavlink_command_long_t& m, uint32_t t_us) {
  if (m.param1 == 1.0f) return arm(b, m, t_us);
  if (m.param1 == 0.0f) return ask(b, WANTS_DISARM);
  return refuse(b, Text::COMMAND_VALUE, MAV_RESULT_DENIED);
}

uint8_t on_stop(Board& b, const mavlink_command_long_t& m) {
  if (m.param1 == 1.0f) return ask(b, condition(HIL_REASON_STOP_COMMAND));
  return refuse(b, Text::COMMAND_VALUE, MAV_RESULT_DENIED);
}

uint8_t on_storage(Board& b, const mavlink_command_long_t& m) {
  if (b.safety.state == HIL_STATE_ARMED) {
    return refuse(b, Text::COMMAND_ARMED, MAV_RESULT_TEMPORARILY_REJECTED);
  }
  if (m.param1 == 1.0f) {
    b.save.wanted = true;
    return MAV_RESULT_IN_PROGRESS;  // board_store() says when it is done
  }
  if (m.param1 != 2.0f) return refuse(b, Text::COMMAND_VALUE, MAV_RESULT_DENIED);
  params_defaults(b.params);
  b.parameter_hash = b.default_hash;
  b.retune_due = true;
  return MAV_RESULT_ACCEPTED;
}

uint8_t on_request_message(Board& b, const mavlink_command_long_t& m) {
  if (m.param1 == static_cast<float>(MAVLINK_MSG_ID_BOARD_INFO)) {
    send_board_info(b);
  } else if (m.param1 == static_cast<float>(MAVLINK_MSG_ID_HEARTBEAT)) {
    send_heartbeat(b);
  } else if (m.param1 == static_cast<float>(MAVLINK_MSG_ID_SYS_STATUS)) {
    send_sys_status(b);
  } else {
    return refuse(b, Text::COMMAND_VALUE, MAV_RESULT_DENIED);
  }
  return MAV_RESULT_ACCEPTED;
}

uint8_t run_command(Board& b, const mavlink_command_long_t& m, uint32_t t_us) {
  switch (m.command) {
    case MAV_CMD_COMPONENT_ARM_DISARM: return on_arm_disarm(b, m, t_us);
    case MAV_CMD_DO_FLIGHTTERMINATION: return on_stop(b, m);
    case MAV_CMD_PREFLIGHT_STORAGE: return on_storage(b, m);
    case MAV_CMD_REQUEST_MESSAGE: return on_request_message(b, m);
    default: return refuse(b, Text::COMMAND_UNKNOWN, MAV_RESULT_UNSUPPORTED);
  }
}

void on_command(Board& b, uint32_t t_us) {
  mavlink_command_long_t m;
  mavlink_msg_command_long_decode(&b.link.rx, &m);
  if (!is_for_us(m.target_system, m.target_component)) return;
  const uint8_t result = run_command(b, m, t_us);
  protocol_acknowledge(b, m.command, result);
}

// What is wrong with a set-point; Text::COUNT when nothing is.
Text setpoint_flaw(const Board& b, const mavlink_wheel_setpoint_t& m) {
  const float left = m.omega_left_rad_s;
  const float right = m.omega_right_rad_s;
  if (b.safety.state != HIL_STATE_ARMED) return Text::SETPOINT_NOT_ARMED;
  if (!isfinite(left) || !isfinite(right)) return Text::SETPOINT_NOT_FINITE;
  const float limit = b.params.omega_max_rad_s;
  if (fabsf(left) > limit || fabsf(right) > limit) return Text::SETPOINT_RANGE;
  const int16_t ahead = static_cast<int16_t>(static_cast<uint16_t>(m.seq - b.setpoint.seq));
  return b.setpoint.any && ahead <= 0 ? Text::SETPOINT_OLD : Text::COUNT;
}

void on_setpoint(Board& b, uint32_t t_us) {
  mavlink_wheel_setpoint_t m;
  mavlink_msg_wheel_setpoint_decode(&b.link.rx, &m);
  const Text flaw = setpoint_flaw(b, m);
  if (flaw != Text::COUNT) {
    count_up(b.refused);
    say(b, flaw);
    return;
  }
  b.setpoint = {{m.omega_left_rad_s, m.omega_right_rad_s}, m.seq, t_us, true};
}

void on_timesync(Board& b, uint32_t t_us) {
  mavlink_timesync_t m;
  mavlink_msg_timesync_decode(&b.link.rx, &m);
  if (m.tc1 != 0) return;  // an answer, and not to us: the board never asks
  m.tc1 = static_cast<int64_t>(t_us) * 1000;
  mavlink_message_t message;
  mavlink_msg_timesync_encode_status(BOARD_SYSTEM_ID, BOARD_COMPONENT_ID, &b.link.status, &message, &m);
  link_send(b.link, message, WHEEL_STATE_ROOM);
}

Text text_for(ParamResult result) {
  switch (result) {
    case ParamResult::NOT_FINITE: return Text::PARAM_NOT_FINITE;
    case ParamResult::OUT_OF_RANGE: return Text::PARAM_RANGE;
    case ParamResult::FIXED_WHILE_ARMED: return Text::PARAM_FIXED;
    default: return Text::PARAM_UNKNOWN;
  }
}

void change_param(Board& b, uint8_t index, float value) {
  const uint32_t before = param_hash_term(b.params, index);
  const ParamResult result = param_set(b.params, index, value, b.safety.state == HIL_STATE_ARMED);
  if (result != ParamResult::SET) return say(b, text_for(result));
  b.parameter_hash += param_hash_term(b.params, index) - before;
  b.retune_due = true;
}

void on_param_set(Board& b) {
  mavlink_param_set_t m;
  mavlink_msg_param_set_decode(&b.link.rx, &m);
  if (!is_for_us(m.target_system, m.target_component)) return;
  const uint8_t index = param_find(m.param_id);
  if (index == PARAM_COUNT) return say(b, Text::PARAM_UNKNOWN);
  if (m.param_type != MAV_PARAM_TYPE_REAL32) {
    say(b, Text::PARAM_TYPE);
  } else if (!param_is(b.params, index, m.param_value)) {
    change_param(b, index, m.param_value);
  }
  send_param(b, index);
}

void on_param_read(Board& b) {
  mavlink_param_request_read_t m;
  mavlink_msg_param_request_read_decode(&b.link.rx, &m);
  if (!is_for_us(m.target_system, m.target_component)) return;
  const uint8_t by_name = m.param_index < 0 ? param_find(m.param_id) : PARAM_COUNT;
  const bool by_index = m.param_index >= 0 && m.param_index < PARAM_COUNT;
  const uint8_t index = by_index ? static_cast<uint8_t>(m.param_index) : by_name;
  if (index == PARAM_COUNT) return say(b, Text::PARAM_UNKNOWN);
  send_param(b, index);
}

void on_param_list(Board& b) {
  mavlink_param_request_list_t m;
  mavlink_msg_param_request_list_decode(&b.link.rx, &m);
  if (is_for_us(m.target_system, m.target_component)) b.params_next = 0;
}

// Never answered with what it holds, and nothing of it is kept but the key.
void on_setup_signing(Board& b) {
  mavlink_setup_signing_t m;
  mavlink_msg_setup_signing_decode(&b.link.rx, &m);
  if (!is_for_us(m.target_system, m.target_component)) return;
  if (!b.wired) return say(b, Text::KEY_PORT);
  if (b.safety.state == HIL_STATE_ARMED) return say(b, Text::COMMAND_ARMED);
  if (signer_set_key(b.link.signer, m.secret_key, m.initial_timestamp)) link_forget_unsigned(b.link);
}

}  // namespace

void protocol_retune(Board& b) {
  b.tuning = wheel_tuning(b.params);
  b.limits = safety_limits(b.params);
  wheel_retuned(b.wheel[LEFT]);
  wheel_retuned(b.wheel[RIGHT]);
  b.retune_due = false;
  b.retune_wait = RETUNE_TICKS;
}

void protocol_acknowledge(Board& b, uint16_t command, uint8_t result) {
  mavlink_command_ack_t m = {command, result};
  mavlink_message_t message;
  mavlink_msg_command_ack_encode_status(BOARD_SYSTEM_ID, BOARD_COMPONENT_ID, &b.link.status, &message, &m);
  link_send(b.link, message, WHEEL_STATE_ROOM);
}

bool protocol_handle(Board& b, uint32_t t_us) {
  switch (b.link.rx.msgid) {
    case MAVLINK_MSG_ID_WHEEL_SETPOINT: on_setpoint(b, t_us); return false;
    case MAVLINK_MSG_ID_TIMESYNC: on_timesync(b, t_us); return false;
    case MAVLINK_MSG_ID_COMMAND_LONG: on_command(b, t_us); return true;
    case MAVLINK_MSG_ID_PARAM_SET: on_param_set(b); return true;
    case MAVLINK_MSG_ID_PARAM_REQUEST_READ: on_param_read(b); return true;
    case MAVLINK_MSG_ID_PARAM_REQUEST_LIST: on_param_list(b); return false;
    case MAVLINK_MSG_ID_SETUP_SIGNING: on_setup_signing(b); return true;
    default: return false;
  }
}

}  // namespace hil
