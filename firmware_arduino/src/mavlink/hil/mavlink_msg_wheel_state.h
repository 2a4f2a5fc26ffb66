#pragma once
// MESSAGE WHEEL_STATE PACKING

#include <stdint.h>

#define MAVLINK_MSG_ID_WHEEL_STATE 24101


typedef struct __mavlink_wheel_state_t {
 uint32_t t_mcu_us; /*< [us] Board time of the tick the values belong to, wraps.*/
 int32_t left_counts; /*<  Left encoder, x4 quadrature.*/
 int32_t right_counts; /*<  Right encoder, x4 quadrature.*/
 float omega_left_rad_s; /*< [rad/s] Left speed as the loop uses it.*/
 float omega_right_rad_s; /*< [rad/s] Right speed as the loop uses it.*/
 float error_rate_left_rad_s2; /*< [rad/s/s] Filtered derivative of omega - omega*, left.*/
 float error_rate_right_rad_s2; /*< [rad/s/s] Filtered derivative of omega - omega*, right.*/
 float s_left; /*<  Sliding variable, left: rad/s, or rad/s/s in the derivative form; 0 under PID.*/
 float s_right; /*<  Sliding variable, right.*/
 uint32_t t_setpoint_us; /*< [us] Board time at which the set-point named by setpoint_seq arrived.*/
 int16_t pwm_left_counts; /*<  Left PWM, -pwm_top to pwm_top of BOARD_INFO.*/
 int16_t pwm_right_counts; /*<  Right PWM.*/
 uint16_t setpoint_seq; /*<  seq of the last set-point taken.*/
 uint8_t state; /*<  State of the supervisor.*/
 uint8_t reason; /*<  Why it is in that state.*/
 uint8_t flags; /*<  Flags.*/
} mavlink_wheel_state_t;

#define MAVLINK_MSG_ID_WHEEL_STATE_LEN 49
#define MAVLINK_MSG_ID_WHEEL_STATE_MIN_LEN 49
#define MAVLINK_MSG_ID_24101_LEN 49
#define MAVLINK_MSG_ID_24101_MIN_LEN 49

#define MAVLINK_MSG_ID_WHEEL_STATE_CRC 103
#define MAVLINK_MSG_ID_24101_CRC 103



#if MAVLINK_COMMAND_24BIT
#define MAVLINK_MESSAGE_INFO_WHEEL_STATE { \
    24101, \
    "WHEEL_STATE", \
    16, \
    {  { "t_mcu_us", NULL, MAVLINK_TYPE_UINT32_T, 0, 0, offsetof(mavlink_wheel_state_t, t_mcu_us) }, \
         { "left_counts", NULL, MAVLINK_TYPE_INT32_T, 0, 4, offsetof(mavlink_wheel_state_t, left_counts) }, \
         { "right_counts", NULL, MAVLINK_TYPE_INT32_T, 0, 8, offsetof(mavlink_wheel_state_t, right_counts) }, \
         { "omega_left_rad_s", NULL, MAVLINK_TYPE_FLOAT, 0, 12, offsetof(mavlink_wheel_state_t, omega_left_rad_s) }, \
         { "omega_right_rad_s", NULL, MAVLINK_TYPE_FLOAT, 0, 16, offsetof(mavlink_wheel_state_t, omega_right_rad_s) }, \
         { "error_rate_left_rad_s2", NULL, MAVLINK_TYPE_FLOAT, 0, 20, offsetof(mavlink_wheel_state_t, error_rate_left_rad_s2) }, \
         { "error_rate_right_rad_s2", NULL, MAVLINK_TYPE_FLOAT, 0, 24, offsetof(mavlink_wheel_state_t, error_rate_right_rad_s2) }, \
         { "s_left", NULL, MAVLINK_TYPE_FLOAT, 0, 28, offsetof(mavlink_wheel_state_t, s_left) }, \
         { "s_right", NULL, MAVLINK_TYPE_FLOAT, 0, 32, offsetof(mavlink_wheel_state_t, s_right) }, \
         { "t_setpoint_us", NULL, MAVLINK_TYPE_UINT32_T, 0, 36, offsetof(mavlink_wheel_state_t, t_setpoint_us) }, \
         { "pwm_left_counts", NULL, MAVLINK_TYPE_INT16_T, 0, 40, offsetof(mavlink_wheel_state_t, pwm_left_counts) }, \
         { "pwm_right_counts", NULL, MAVLINK_TYPE_INT16_T, 0, 42, offsetof(mavlink_wheel_state_t, pwm_right_counts) }, \
         { "setpoint_seq", NULL, MAVLINK_TYPE_UINT16_T, 0, 44, offsetof(mavlink_wheel_state_t, setpoint_seq) }, \
         { "state", NULL, MAVLINK_TYPE_UINT8_T, 0, 46, offsetof(mavlink_wheel_state_t, state) }, \
         { "reason", NULL, MAVLINK_TYPE_UINT8_T, 0, 47, offsetof(mavlink_wheel_state_t, reason) }, \
         { "flags", NULL, MAVLINK_TYPE_UINT8_T, 0, 48, offsetof(mavlink_wheel_state_t, flags) }, \
         } \
}
#else
#define MAVLINK_MESSAGE_INFO_WHEEL_STATE { \
    "WHEEL_STATE", \
    16, \
    {  { "t_mcu_us", NULL, MAVLINK_TYPE_UINT32_T, 0, 0, offsetof(mavlink_wheel_state_t, t_mcu_us) }, \
         { "left_counts", NULL, MAVLINK_TYPE_INT32_T, 0, 4, offsetof(mavlink_wheel_state_t, left_counts) }, \
         { "right_counts", NULL, MAVLINK_TYPE_INT32_T, 0, 8, offsetof(mavlink_wheel_state_t, right_counts) }, \
         { "omega_left_rad_s", NULL, MAVLINK_TYPE_FLOAT, 0, 12, offsetof(mavlink_wheel_state_t, omega_left_rad_s) }, \
         { "omega_right_rad_s", NULL, MAVLINK_TYPE_FLOAT, 0, 16, offsetof(mavlink_wheel_state_t, omega_right_rad_s) }, \
         { "error_rate_left_rad_s2", NULL, MAVLINK_TYPE_FLOAT, 0, 20, offsetof(mavlink_wheel_state_t, error_rate_left_rad_s2) }, \
         { "error_rate_right_rad_s2", NULL, MAVLINK_TYPE_FLOAT, 0, 24, offsetof(mavlink_wheel_state_t, error_rate_right_rad_s2) }, \
         { "s_left", NULL, MAVLINK_TYPE_FLOAT, 0, 28, offsetof(mavlink_wheel_state_t, s_left) }, \
         { "s_right", NULL, MAVLINK_TYPE_FLOAT, 0, 32, offsetof(mavlink_wheel_state_t, s_right) }, \
         { "t_setpoint_us", NULL, MAVLINK_TYPE_UINT32_T, 0, 36, offsetof(mavlink_wheel_state_t, t_setpoint_us) }, \
         { "pwm_left_counts", NULL, MAVLINK_TYPE_INT16_T, 0, 40, offsetof(mavlink_wheel_state_t, pwm_left_counts) }, \
         { "pwm_right_counts", NULL, MAVLINK_TYPE_INT16_T, 0, 42, offsetof(mavlink_wheel_state_t, pwm_right_counts) }, \
         { "setpoint_seq", NULL, MAVLINK_TYPE_UINT16_T, 0, 44, offsetof(mavlink_wheel_state_t, setpoint_seq) }, \
         { "state", NULL, MAVLINK_TYPE_UINT8_T, 0, 46, offsetof(mavlink_wheel_state_t, state) }, \
         { "reason", NULL, MAVLINK_TYPE_UINT8_T, 0, 47, offsetof(mavlink_wheel_state_t, reason) }, \
         { "flags", NULL, MAVLINK_TYPE_UINT8_T, 0, 48, offsetof(mavlink_wheel_state_t, flags) }, \
         } \
}
#endif

/**
 * @brief Pack a wheel_state message
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param msg The MAVLink message to compress the data into
 *
 * @param t_mcu_us [us] Board time of the tick the values belong to, wraps.
 * @param left_counts  Left encoder, x4 quadrature.
 * @param right_counts  Right encoder, x4 quadrature.
 * @param omega_left_rad_s [rad/s] Left speed as the loop uses it.
 * @param omega_right_rad_s [rad/s] Right speed as the loop uses it.
 * @param error_rate_left_rad_s2 [rad/s/s] Filtered derivative of omega - omega*, left.
 * @param error_rate_right_rad_s2 [rad/s/s] Filtered derivative of omega - omega*, right.
 * @param s_left  Sliding variable, left: rad/s, or rad/s/s in the derivative form; 0 under PID.
 * @param s_right  Sliding variable, right.
 * @param t_setpoint_us [us] Board time at which the set-point named by setpoint_seq arrived.
 * @param pwm_left_counts  Left PWM, -pwm_top to pwm_top of BOARD_INFO.
 * @param pwm_right_counts  Right PWM.
 * @param setpoint_seq  seq of the last set-point taken.
 * @param state  State of the supervisor.
 * @param reason  Why it is in that state.
 * @param flags  Flags.
 * @return length of the message in bytes (excluding serial stream start sign)
 */
static inline uint16_t mavlink_msg_wheel_state_pack(uint8_t system_id, uint8_t component_id, mavlink_message_t* msg,
                               uint32_t t_mcu_us, int32_t left_counts, int32_t right_counts, float omega_left_rad_s, float omega_right_rad_s, float error_rate_left_rad_s2, float error_rate_right_rad_s2, float s_left, float s_right, uint32_t t_setpoint_us, int16_t pwm_left_counts, int16_t pwm_right_counts, uint16_t setpoint_seq, uint8_t state, uint8_t reason, uint8_t flags)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_WHEEL_STATE_LEN];
    _mav_put_uint32_t(buf, 0, t_mcu_us);
    _mav_put_int32_t(buf, 4, left_counts);
    _mav_put_int32_t(buf, 8, right_counts);
    _mav_put_float(buf, 12, omega_left_rad_s);
    _mav_put_float(buf, 16, omega_right_rad_s);
    _mav_put_float(buf, 20, error_rate_left_rad_s2);
    _mav_put_float(buf, 24, error_rate_right_rad_s2);
    _mav_put_float(buf, 28, s_left);
    _mav_put_float(buf, 32, s_right);
    _mav_put_uint32_t(buf, 36, t_setpoint_us);
    _mav_put_int16_t(buf, 40, pwm_left_counts);
    _mav_put_int16_t(buf, 42, pwm_right_counts);
    _mav_put_uint16_t(buf, 44, setpoint_seq);
    _mav_put_uint8_t(buf, 46, state);
    _mav_put_uint8_t(buf, 47, reason);
    _mav_put_uint8_t(buf, 48, flags);

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), buf, MAVLINK_MSG_ID_WHEEL_STATE_LEN);
#else
    mavlink_wheel_state_t packet;
    packet.t_mcu_us = t_mcu_us;
    packet.left_counts = left_counts;
    packet.right_counts = right_counts;
    packet.omega_left_rad_s = omega_left_rad_s;
    packet.omega_right_rad_s = omega_right_rad_s;
    packet.error_rate_left_rad_s2 = error_rate_left_rad_s2;
    packet.error_rate_right_rad_s2 = error_rate_right_rad_s2;
    packet.s_left = s_left;
    packet.s_right = s_right;
    packet.t_setpoint_us = t_setpoint_us;
    packet.pwm_left_counts = pwm_left_counts;
    packet.pwm_right_counts = pwm_right_counts;
    packet.setpoint_seq = setpoint_seq;
    packet.state = state;
    packet.reason = reason;
    packet.flags = flags;

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), &packet, MAVLINK_MSG_ID_WHEEL_STATE_LEN);
#endif

    msg->msgid = MAVLINK_MSG_ID_WHEEL_STATE;
    return mavlink_finalize_message(msg, system_id, component_id, MAVLINK_MSG_ID_WHEEL_STATE_MIN_LEN, MAVLINK_MSG_ID_WHEEL_STATE_LEN, MAVLINK_MSG_ID_WHEEL_STATE_CRC);
}

/**
 * @brief Pack a wheel_state message
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param status MAVLink status structure
 * @param msg The MAVLink message to compress the data into
 *
 * @param t_mcu_us [us] Board time of the tick the values belong to, wraps.
 * @param left_counts  Left encoder, x4 quadrature.
 * @param right_counts  Right encoder, x4 quadrature.
 * @param omega_left_rad_s [rad/s] Left speed as the loop uses it.
 * @param omega_right_rad_s [rad/s] Right speed as the loop uses it.
 * @param error_rate_left_rad_s2 [rad/s/s] Filtered derivative of omega - omega*, left.
 * @param error_rate_right_rad_s2 [rad/s/s] Filtered derivative of omega - omega*, right.
 * @param s_left  Sliding variable, left: rad/s, or rad/s/s in the derivative form; 0 under PID.
 * @param s_right  Sliding variable, right.
 * @param t_setpoint_us [us] Board time at which the set-point named by setpoint_seq arrived.
 * @param pwm_left_counts  Left PWM, -pwm_top to pwm_top of BOARD_INFO.
 * @param pwm_right_counts  Right PWM.
 * @param setpoint_seq  seq of the last set-point taken.
 * @param state  State of the supervisor.
 * @param reason  Why it is in that state.
 * @param flags  Flags.
 * @return length of the message in bytes (excluding serial stream start sign)
 */
static inline uint16_t mavlink_msg_wheel_state_pack_status(uint8_t system_id, uint8_t component_id, mavlink_status_t *_status, mavlink_message_t* msg,
                               uint32_t t_mcu_us, int32_t left_counts, int32_t right_counts, float omega_left_rad_s, float omega_right_rad_s, float error_rate_left_rad_s2, float error_rate_right_rad_s2, float s_left, float s_right, uint32_t t_setpoint_us, int16_t pwm_left_counts, int16_t pwm_right_counts, uint16_t setpoint_seq, uint8_t state, uint8_t reason, uint8_t flags)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_WHEEL_STATE_LEN];
    _mav_put_uint32_t(buf, 0, t_mcu_us);
    _mav_put_int32_t(buf, 4, left_counts);
    _mav_put_int32_t(buf, 8, right_counts);
    _mav_put_float(buf, 12, omega_left_rad_s);
    _mav_put_float(buf, 16, omega_right_rad_s);
    _mav_put_float(buf, 20, error_rate_left_rad_s2);
    _mav_put_float(buf, 24, error_rate_right_rad_s2);
    _mav_put_float(buf, 28, s_left);
    _mav_put_float(buf, 32, s_right);
    _mav_put_uint32_t(buf, 36, t_setpoint_us);
    _mav_put_int16_t(buf, 40, pwm_left_counts);
    _mav_put_int16_t(buf, 42, pwm_right_counts);
    _mav_put_uint16_t(buf, 44, setpoint_seq);
    _mav_put_uint8_t(buf, 46, state);
    _mav_put_uint8_t(buf, 47, reason);
    _mav_put_uint8_t(buf, 48, flags);

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), buf, MAVLINK_MSG_ID_WHEEL_STATE_LEN);
#else
    mavlink_wheel_state_t packet;
    packet.t_mcu_us = t_mcu_us;
    packet.left_counts = left_counts;
    packet.right_counts = right_counts;
    packet.omega_left_rad_s = omega_left_rad_s;
    packet.omega_right_rad_s = omega_right_rad_s;
    packet.error_rate_left_rad_s2 = error_rate_left_rad_s2;
    packet.error_rate_right_rad_s2 = error_rate_right_rad_s2;
    packet.s_left = s_left;
    packet.s_right = s_right;
    packet.t_setpoint_us = t_setpoint_us;
    packet.pwm_left_counts = pwm_left_counts;
    packet.pwm_right_counts = pwm_right_counts;
    packet.setpoint_seq = setpoint_seq;
    packet.state = state;
    packet.reason = reason;
    packet.flags = flags;

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), &packet, MAVLINK_MSG_ID_WHEEL_STATE_LEN);
#endif

    msg->msgid = MAVLINK_MSG_ID_WHEEL_STATE;
#if MAVLINK_CRC_EXTRA
    return mavlink_finalize_message_buffer(msg, system_id, component_id, _status, MAVLINK_MSG_ID_WHEEL_STATE_MIN_LEN, MAVLINK_MSG_ID_WHEEL_STATE_LEN, MAVLINK_MSG_ID_WHEEL_STATE_CRC);
#else
    return mavlink_finalize_message_buffer(msg, system_id, component_id, _status, MAVLINK_MSG_ID_WHEEL_STATE_MIN_LEN, MAVLINK_MSG_ID_WHEEL_STATE_LEN);
#endif
}

/**
 * @brief Pack a wheel_state message on a channel
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param chan The MAVLink channel this message will be sent over
 * @param msg The MAVLink message to compress the data into
 * @param t_mcu_us [us] Board time of the tick the values belong to, wraps.
 * @param left_counts  Left encoder, x4 quadrature.
 * @param right_counts  Right encoder, x4 quadrature.
 * @param omega_left_rad_s [rad/s] Left speed as the loop uses it.
 * @param omega_right_rad_s [rad/s] Right speed as the loop uses it.
 * @param error_rate_left_rad_s2 [rad/s/s] Filtered derivative of omega - omega*, left.
 * @param error_rate_right_rad_s2 [rad/s/s] Filtered derivative of omega - omega*, right.
 * @param s_left  Sliding variable, left: rad/s, or rad/s/s in the derivative form; 0 under PID.
 * @param s_right  Sliding variable, right.
 * @param t_setpoint_us [us] Board time at which the set-point named by setpoint_seq arrived.
 * @param pwm_left_counts  Left PWM, -pwm_top to pwm_top of BOARD_INFO.
 * @param pwm_right_counts  Right PWM.
 * @param setpoint_seq  seq of the last set-point taken.
 * @param state  State of the supervisor.
 * @param reason  Why it is in that state.
 * @param flags  Flags.
 * @return length of the message in bytes (excluding serial stream start sign)
 */
static inline uint16_t mavlink_msg_wheel_state_pack_chan(uint8_t system_id, uint8_t component_id, uint8_t chan,
                               mavlink_message_t* msg,
                                   uint32_t t_mcu_us,int32_t left_counts,int32_t right_counts,float omega_left_rad_s,float omega_right_rad_s,float error_rate_left_rad_s2,float error_rate_right_rad_s2,float s_left,float s_right,uint32_t t_setpoint_us,int16_t pwm_left_counts,int16_t pwm_right_counts,uint16_t setpoint_seq,uint8_t state,uint8_t reason,uint8_t flags)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_WHEEL_STATE_LEN];
    _mav_put_uint32_t(buf, 0, t_mcu_us);
    _mav_put_int32_t(buf, 4, left_counts);
    _mav_put_int32_t(buf, 8, right_counts);
    _mav_put_float(buf, 12, omega_left_rad_s);
    _mav_put_float(buf, 16, omega_right_rad_s);
    _mav_put_float(buf, 20, error_rate_left_rad_s2);
    _mav_put_float(buf, 24, error_rate_right_rad_s2);
    _mav_put_float(buf, 28, s_left);
    _mav_put_float(buf, 32, s_right);
    _mav_put_uint32_t(buf, 36, t_setpoint_us);
    _mav_put_int16_t(buf, 40, pwm_left_counts);
    _mav_put_int16_t(buf, 42, pwm_right_counts);
    _mav_put_uint16_t(buf, 44, setpoint_seq);
    _mav_put_uint8_t(buf, 46, state);
    _mav_put_uint8_t(buf, 47, reason);
    _mav_put_uint8_t(buf, 48, flags);

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), buf, MAVLINK_MSG_ID_WHEEL_STATE_LEN);
#else
    mavlink_wheel_state_t packet;
    packet.t_mcu_us = t_mcu_us;
    packet.left_counts = left_counts;
    packet.right_counts = right_counts;
    packet.omega_left_rad_s = omega_left_rad_s;
    packet.omega_right_rad_s = omega_right_rad_s;
    packet.error_rate_left_rad_s2 = error_rate_left_rad_s2;
    packet.error_rate_right_rad_s2 = error_rate_right_rad_s2;
    packet.s_left = s_left;
    packet.s_right = s_right;
    packet.t_setpoint_us = t_setpoint_us;
    packet.pwm_left_counts = pwm_left_counts;
    packet.pwm_right_counts = pwm_right_counts;
    packet.setpoint_seq = setpoint_seq;
    packet.state = state;
    packet.reason = reason;
    packet.flags = flags;

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), &packet, MAVLINK_MSG_ID_WHEEL_STATE_LEN);
#endif

    msg->msgid = MAVLINK_MSG_ID_WHEEL_STATE;
    return mavlink_finalize_message_chan(msg, system_id, component_id, chan, MAVLINK_MSG_ID_WHEEL_STATE_MIN_LEN, MAVLINK_MSG_ID_WHEEL_STATE_LEN, MAVLINK_MSG_ID_WHEEL_STATE_CRC);
}

/**
 * @brief Encode a wheel_state struct
 *
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param msg The MAVLink message to compress the data into
 * @param wheel_state C-struct to read the message contents from
 */
static inline uint16_t mavlink_msg_wheel_state_encode(uint8_t system_id, uint8_t component_id, mavlink_message_t* msg, const mavlink_wheel_state_t* wheel_state)
{
    return mavlink_msg_wheel_state_pack(system_id, component_id, msg, wheel_state->t_mcu_us, wheel_state->left_counts, wheel_state->right_counts, wheel_state->omega_left_rad_s, wheel_state->omega_right_rad_s, wheel_state->error_rate_left_rad_s2, wheel_state->error_rate_right_rad_s2, wheel_state->s_left, wheel_state->s_right, wheel_state->t_setpoint_us, wheel_state->pwm_left_counts, wheel_state->pwm_right_counts, wheel_state->setpoint_seq, wheel_state->state, wheel_state->reason, wheel_state->flags);
}

/**
 * @brief Encode a wheel_state struct on a channel
 *
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param chan The MAVLink channel this message will be sent over
 * @param msg The MAVLink message to compress the data into
 * @param wheel_state C-struct to read the message contents from
 */
static inline uint16_t mavlink_msg_wheel_state_encode_chan(uint8_t system_id, uint8_t component_id, uint8_t chan, mavlink_message_t* msg, const mavlink_wheel_state_t* wheel_state)
{
    return mavlink_msg_wheel_state_pack_chan(system_id, component_id, chan, msg, wheel_state->t_mcu_us, wheel_state->left_counts, wheel_state->right_counts, wheel_state->omega_left_rad_s, wheel_state->omega_right_rad_s, wheel_state->error_rate_left_rad_s2, wheel_state->error_rate_right_rad_s2, wheel_state->s_left, wheel_state->s_right, wheel_state->t_setpoint_us, wheel_state->pwm_left_counts, wheel_state->pwm_right_counts, wheel_state->setpoint_seq, wheel_state->state, wheel_state->reason, wheel_state->flags);
}

/**
 * @brief Encode a wheel_state struct with provided status structure
 *
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param status MAVLink status structure
 * @param msg The MAVLink message to compress the data into
 * @param wheel_state C-struct to read the message contents from
 */
static inline uint16_t mavlink_msg_wheel_state_encode_status(uint8_t system_id, uint8_t component_id, mavlink_status_t* _status, mavlink_message_t* msg, const mavlink_wheel_state_t* wheel_state)
{
    return mavlink_msg_wheel_state_pack_status(system_id, component_id, _status, msg,  wheel_state->t_mcu_us, wheel_state->left_counts, wheel_state->right_counts, wheel_state->omega_left_rad_s, wheel_state->omega_right_rad_s, wheel_state->error_rate_left_rad_s2, wheel_state->error_rate_right_rad_s2, wheel_state->s_left, wheel_state->s_right, wheel_state->t_setpoint_us, wheel_state->pwm_left_counts, wheel_state->pwm_right_counts, wheel_state->setpoint_seq, wheel_state->state, wheel_state->reason, wheel_state->flags);
}

/**
 * @brief Send a wheel_state message
 * @param chan MAVLink channel to send the message
 *
 * @param t_mcu_us [us] Board time of the tick the values belong to, wraps.
 * @param left_counts  Left encoder, x4 quadrature.
 * @param right_counts  Right encoder, x4 quadrature.
 * @param omega_left_rad_s [rad/s] Left speed as the loop uses it.
 * @param omega_right_rad_s [rad/s] Right speed as the loop uses it.
 * @param error_rate_left_rad_s2 [rad/s/s] Filtered derivative of omega - omega*, left.
 * @param error_rate_right_rad_s2 [rad/s/s] Filtered derivative of omega - omega*, right.
 * @param s_left  Sliding variable, left: rad/s, or rad/s/s in the derivative form; 0 under PID.
 * @param s_right  Sliding variable, right.
 * @param t_setpoint_us [us] Board time at which the set-point named by setpoint_seq arrived.
 * @param pwm_left_counts  Left PWM, -pwm_top to pwm_top of BOARD_INFO.
 * @param pwm_right_counts  Right PWM.
 * @param setpoint_seq  seq of the last set-point taken.
 * @param state  State of the supervisor.
 * @param reason  Why it is in that state.
 * @param flags  Flags.
 */
#ifdef MAVLINK_USE_CONVENIENCE_FUNCTIONS

static inline void mavlink_msg_wheel_state_send(mavlink_channel_t chan, uint32_t t_mcu_us, int32_t left_counts, int32_t right_counts, float omega_left_rad_s, float omega_right_rad_s, float error_rate_left_rad_s2, float error_rate_right_rad_s2, float s_left, float s_right, uint32_t t_setpoint_us, int16_t pwm_left_counts, int16_t pwm_right_counts, uint16_t setpoint_seq, uint8_t state, uint8_t reason, uint8_t flags)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_WHEEL_STATE_LEN];
    _mav_put_uint32_t(buf, 0, t_mcu_us);
    _mav_put_int32_t(buf, 4, left_counts);
    _mav_put_int32_t(buf, 8, right_counts);
    _mav_put_float(buf, 12, omega_left_rad_s);
    _mav_put_float(buf, 16, omega_right_rad_s);
    _mav_put_float(buf, 20, error_rate_left_rad_s2);
    _mav_put_float(buf, 24, error_rate_right_rad_s2);
    _mav_put_float(buf, 28, s_left);
    _mav_put_float(buf, 32, s_right);
    _mav_put_uint32_t(buf, 36, t_setpoint_us);
    _mav_put_int16_t(buf, 40, pwm_left_counts);
    _mav_put_int16_t(buf, 42, pwm_right_counts);
    _mav_put_uint16_t(buf, 44, setpoint_seq);
    _mav_put_uint8_t(buf, 46, state);
    _mav_put_uint8_t(buf, 47, reason);
    _mav_put_uint8_t(buf, 48, flags);

    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_WHEEL_STATE, buf, MAVLINK_MSG_ID_WHEEL_STATE_MIN_LEN, MAVLINK_MSG_ID_WHEEL_STATE_LEN, MAVLINK_MSG_ID_WHEEL_STATE_CRC);
#else
    mavlink_wheel_state_t packet;
    packet.t_mcu_us = t_mcu_us;
    packet.left_counts = left_counts;
    packet.right_counts = right_counts;
    packet.omega_left_rad_s = omega_left_rad_s;
    packet.omega_right_rad_s = omega_right_rad_s;
    packet.error_rate_left_rad_s2 = error_rate_left_rad_s2;
    packet.error_rate_right_rad_s2 = error_rate_right_rad_s2;
    packet.s_left = s_left;
    packet.s_right = s_right;
    packet.t_setpoint_us = t_setpoint_us;
    packet.pwm_left_counts = pwm_left_counts;
    packet.pwm_right_counts = pwm_right_counts;
    packet.setpoint_seq = setpoint_seq;
    packet.state = state;
    packet.reason = reason;
    packet.flags = flags;

    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_WHEEL_STATE, (const char *)&packet, MAVLINK_MSG_ID_WHEEL_STATE_MIN_LEN, MAVLINK_MSG_ID_WHEEL_STATE_LEN, MAVLINK_MSG_ID_WHEEL_STATE_CRC);
#endif
}

/**
 * @brief Send a wheel_state message
 * @param chan MAVLink channel to send the message
 * @param struct The MAVLink struct to serialize
 */
static inline void mavlink_msg_wheel_state_send_struct(mavlink_channel_t chan, const mavlink_wheel_state_t* wheel_state)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    mavlink_msg_wheel_state_send(chan, wheel_state->t_mcu_us, wheel_state->left_counts, wheel_state->right_counts, wheel_state->omega_left_rad_s, wheel_state->omega_right_rad_s, wheel_state->error_rate_left_rad_s2, wheel_state->error_rate_right_rad_s2, wheel_state->s_left, wheel_state->s_right, wheel_state->t_setpoint_us, wheel_state->pwm_left_counts, wheel_state->pwm_right_counts, wheel_state->setpoint_seq, wheel_state->state, wheel_state->reason, wheel_state->flags);
#else
    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_WHEEL_STATE, (const char *)wheel_state, MAVLINK_MSG_ID_WHEEL_STATE_MIN_LEN, MAVLINK_MSG_ID_WHEEL_STATE_LEN, MAVLINK_MSG_ID_WHEEL_STATE_CRC);
#endif
}

#if MAVLINK_MSG_ID_WHEEL_STATE_LEN <= MAVLINK_MAX_PAYLOAD_LEN
/*
  This variant of _send() can be used to save stack space by reusing
  memory from the receive buffer.  The caller provides a
  mavlink_message_t which is the size of a full mavlink message. This
  is usually the receive buffer for the channel, and allows a reply to an
  incoming message with minimum stack space usage.
 */
static inline void mavlink_msg_wheel_state_send_buf(mavlink_message_t *msgbuf, mavlink_channel_t chan,  uint32_t t_mcu_us, int32_t left_counts, int32_t right_counts, float omega_left_rad_s, float omega_right_rad_s, float error_rate_left_rad_s2, float error_rate_right_rad_s2, float s_left, float s_right, uint32_t t_setpoint_us, int16_t pwm_left_counts, int16_t pwm_right_counts, uint16_t setpoint_seq, uint8_t state, uint8_t reason, uint8_t flags)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char *buf = (char *)msgbuf;
    _mav_put_uint32_t(buf, 0, t_mcu_us);
    _mav_put_int32_t(buf, 4, left_counts);
    _mav_put_int32_t(buf, 8, right_counts);
    _mav_put_float(buf, 12, omega_left_rad_s);
    _mav_put_float(buf, 16, omega_right_rad_s);
    _mav_put_float(buf, 20, error_rate_left_rad_s2);
    _mav_put_float(buf, 24, error_rate_right_rad_s2);
    _mav_put_float(buf, 28, s_left);
    _mav_put_float(buf, 32, s_right);
    _mav_put_uint32_t(buf, 36, t_setpoint_us);
    _mav_put_int16_t(buf, 40, pwm_left_counts);
    _mav_put_int16_t(buf, 42, pwm_right_counts);
    _mav_put_uint16_t(buf, 44, setpoint_seq);
    _mav_put_uint8_t(buf, 46, state);
    _mav_put_uint8_t(buf, 47, reason);
    _mav_put_uint8_t(buf, 48, flags);

    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_WHEEL_STATE, buf, MAVLINK_MSG_ID_WHEEL_STATE_MIN_LEN, MAVLINK_MSG_ID_WHEEL_STATE_LEN, MAVLINK_MSG_ID_WHEEL_STATE_CRC);
#else
    mavlink_wheel_state_t *packet = (mavlink_wheel_state_t *)msgbuf;
    packet->t_mcu_us = t_mcu_us;
    packet->left_counts = left_counts;
    packet->right_counts = right_counts;
    packet->omega_left_rad_s = omega_left_rad_s;
    packet->omega_right_rad_s = omega_right_rad_s;
    packet->error_rate_left_rad_s2 = error_rate_left_rad_s2;
    packet->error_rate_right_rad_s2 = error_rate_right_rad_s2;
    packet->s_left = s_left;
    packet->s_right = s_right;
    packet->t_setpoint_us = t_setpoint_us;
    packet->pwm_left_counts = pwm_left_counts;
    packet->pwm_right_counts = pwm_right_counts;
    packet->setpoint_seq = setpoint_seq;
    packet->state = state;
    packet->reason = reason;
    packet->flags = flags;

    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_WHEEL_STATE, (const char *)packet, MAVLINK_MSG_ID_WHEEL_STATE_MIN_LEN, MAVLINK_MSG_ID_WHEEL_STATE_LEN, MAVLINK_MSG_ID_WHEEL_STATE_CRC);
#endif
}
#endif

#endif

// MESSAGE WHEEL_STATE UNPACKING


/**
 * @brief Get field t_mcu_us from wheel_state message
 *
 * @return [us] Board time of the tick the values belong to, wraps.
 */
static inline uint32_t mavlink_msg_wheel_state_get_t_mcu_us(const mavlink_message_t* msg)
{
    return _MAV_RETURN_uint32_t(msg,  0);
}

/**
 * @brief Get field left_counts from wheel_state message
 *
 * @return  Left encoder, x4 quadrature.
 */
static inline int32_t mavlink_msg_wheel_state_get_left_counts(const mavlink_message_t* msg)
{
    return _MAV_RETURN_int32_t(msg,  4);
}

/**
 * @brief Get field right_counts from wheel_state message
 *
 * @return  Right encoder, x4 quadrature.
 */
static inline int32_t mavlink_msg_wheel_state_get_right_counts(const mavlink_message_t* msg)
{
    return _MAV_RETURN_int32_t(msg,  8);
}

/**
 * @brief Get field omega_left_rad_s from wheel_state message
 *
 * @return [rad/s] Left speed as the loop uses it.
 */
static inline float mavlink_msg_wheel_state_get_omega_left_rad_s(const mavlink_message_t* msg)
{
    return _MAV_RETURN_float(msg,  12);
}

/**
 * @brief Get field omega_right_rad_s from wheel_state message
 *
 * @return [rad/s] Right speed as the loop uses it.
 */
static inline float mavlink_msg_wheel_state_get_omega_right_rad_s(const mavlink_message_t* msg)
{
    return _MAV_RETURN_float(msg,  16);
}

/**
 * @brief Get field error_rate_left_rad_s2 from wheel_state message
 *
 * @return [rad/s/s] Filtered derivative of omega - omega*, left.
 */
static inline float mavlink_msg_wheel_state_get_error_rate_left_rad_s2(const mavlink_message_t* msg)
{
    return _MAV_RETURN_float(msg,  20);
}

/**
 * @brief Get field error_rate_right_rad_s2 from wheel_state message
 *
 * @return [rad/s/s] Filtered derivative of omega - omega*, right.
 */
static inline float mavlink_msg_wheel_state_get_error_rate_right_rad_s2(const mavlink_message_t* msg)
{
    return _MAV_RETURN_float(msg,  24);
}

/**
 * @brief Get field s_left from wheel_state message
 *
 * @return  Sliding variable, left: rad/s, or rad/s/s in the derivative form; 0 under PID.
 */
static inline float mavlink_msg_wheel_state_get_s_left(const mavlink_message_t* msg)
{
    return _MAV_RETURN_float(msg,  28);
}

/**
 * @brief Get field s_right from wheel_state message
 *
 * @return  Sliding variable, right.
 */
static inline float mavlink_msg_wheel_state_get_s_right(const mavlink_message_t* msg)
{
    return _MAV_RETURN_float(msg,  32);
}

/**
 * @brief Get field t_setpoint_us from wheel_state message
 *
 * @return [us] Board time at which the set-point named by setpoint_seq arrived.
 */
static inline uint32_t mavlink_msg_wheel_state_get_t_setpoint_us(const mavlink_message_t* msg)
{
    return _MAV_RETURN_uint32_t(msg,  36);
}

/**
 * @brief Get field pwm_left_counts from wheel_state message
 *
 * @return  Left PWM, -pwm_top to pwm_top of BOARD_INFO.
 */
static inline int16_t mavlink_msg_wheel_state_get_pwm_left_counts(const mavlink_message_t* msg)
{
    return _MAV_RETURN_int16_t(msg,  40);
}

/**
 * @brief Get field pwm_right_counts from wheel_state message
 *
 * @return  Right PWM.
 */
static inline int16_t mavlink_msg_wheel_state_get_pwm_right_counts(const mavlink_message_t* msg)
{
    return _MAV_RETURN_int16_t(msg,  42);
}

/**
 * @brief Get field setpoint_seq from wheel_state message
 *
 * @return  seq of the last set-point taken.
 */
static inline uint16_t mavlink_msg_wheel_state_get_setpoint_seq(const mavlink_message_t* msg)
{
    return _MAV_RETURN_uint16_t(msg,  44);
}

/**
 * @brief Get field state from wheel_state message
 *
 * @return  State of the supervisor.
 */
static inline uint8_t mavlink_msg_wheel_state_get_state(const mavlink_message_t* msg)
{
    return _MAV_RETURN_uint8_t(msg,  46);
}

/**
 * @brief Get field reason from wheel_state message
 *
 * @return  Why it is in that state.
 */
static inline uint8_t mavlink_msg_wheel_state_get_reason(const mavlink_message_t* msg)
{
    return _MAV_RETURN_uint8_t(msg,  47);
}

/**
 * @brief Get field flags from wheel_state message
 *
 * @return  Flags.
 */
static inline uint8_t mavlink_msg_wheel_state_get_flags(const mavlink_message_t* msg)
{
    return _MAV_RETURN_uint8_t(msg,  48);
}

/**
 * @brief Decode a wheel_state message into a struct
 *
 * @param msg The message to decode
 * @param wheel_state C-struct to decode the message contents into
 */
static inline void mavlink_msg_wheel_state_decode(const mavlink_message_t* msg, mavlink_wheel_state_t* wheel_state)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    wheel_state->t_mcu_us = mavlink_msg_wheel_state_get_t_mcu_us(msg);
    wheel_state->left_counts = mavlink_msg_wheel_state_get_left_counts(msg);
    wheel_state->right_counts = mavlink_msg_wheel_state_get_right_counts(msg);
    wheel_state->omega_left_rad_s = mavlink_msg_wheel_state_get_omega_left_rad_s(msg);
    wheel_state->omega_right_rad_s = mavlink_msg_wheel_state_get_omega_right_rad_s(msg);
    wheel_state->error_rate_left_rad_s2 = mavlink_msg_wheel_state_get_error_rate_left_rad_s2(msg);
    wheel_state->error_rate_right_rad_s2 = mavlink_msg_wheel_state_get_error_rate_right_rad_s2(msg);
    wheel_state->s_left = mavlink_msg_wheel_state_get_s_left(msg);
    wheel_state->s_right = mavlink_msg_wheel_state_get_s_right(msg);
    wheel_state->t_setpoint_us = mavlink_msg_wheel_state_get_t_setpoint_us(msg);
    wheel_state->pwm_left_counts = mavlink_msg_wheel_state_get_pwm_left_counts(msg);
    wheel_state->pwm_right_counts = mavlink_msg_wheel_state_get_pwm_right_counts(msg);
    wheel_state->setpoint_seq = mavlink_msg_wheel_state_get_setpoint_seq(msg);
    wheel_state->state = mavlink_msg_wheel_state_get_state(msg);
    wheel_state->reason = mavlink_msg_wheel_state_get_reason(msg);
    wheel_state->flags = mavlink_msg_wheel_state_get_flags(msg);
#else
        uint8_t len = msg->len < MAVLINK_MSG_ID_WHEEL_STATE_LEN? msg->len : MAVLINK_MSG_ID_WHEEL_STATE_LEN;
        memset(wheel_state, 0, MAVLINK_MSG_ID_WHEEL_STATE_LEN);
    memcpy(wheel_state, _MAV_PAYLOAD(msg), len);
#endif
}
