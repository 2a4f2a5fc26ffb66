#pragma once
// MESSAGE BOARD_INFO PACKING

#include <stdint.h>

#define MAVLINK_MSG_ID_BOARD_INFO 24102


typedef struct __mavlink_board_info_t {
 uint32_t dialect_hash; /*<  Hash of the dialect compiled into the board.*/
 uint32_t parameter_hash; /*<  Hash over names and values of all parameters in force.*/
 uint16_t pwm_top_counts; /*<  PWM counts at full duty.*/
 uint16_t tick_us; /*< [us] Period of the control tick.*/
 char build_id[8]; /*<  Hash of the firmware's sources, first eight hexadecimal digits.*/
} mavlink_board_info_t;

#define MAVLINK_MSG_ID_BOARD_INFO_LEN 20
#define MAVLINK_MSG_ID_BOARD_INFO_MIN_LEN 20
#define MAVLINK_MSG_ID_24102_LEN 20
#define MAVLINK_MSG_ID_24102_MIN_LEN 20

#define MAVLINK_MSG_ID_BOARD_INFO_CRC 225
#define MAVLINK_MSG_ID_24102_CRC 225

#define MAVLINK_MSG_BOARD_INFO_FIELD_BUILD_ID_LEN 8

#if MAVLINK_COMMAND_24BIT
#define MAVLINK_MESSAGE_INFO_BOARD_INFO { \
    24102, \
    "BOARD_INFO", \
    5, \
    {  { "dialect_hash", NULL, MAVLINK_TYPE_UINT32_T, 0, 0, offsetof(mavlink_board_info_t, dialect_hash) }, \
         { "parameter_hash", NULL, MAVLINK_TYPE_UINT32_T, 0, 4, offsetof(mavlink_board_info_t, parameter_hash) }, \
         { "pwm_top_counts", NULL, MAVLINK_TYPE_UINT16_T, 0, 8, offsetof(mavlink_board_info_t, pwm_top_counts) }, \
         { "tick_us", NULL, MAVLINK_TYPE_UINT16_T, 0, 10, offsetof(mavlink_board_info_t, tick_us) }, \
         { "build_id", NULL, MAVLINK_TYPE_CHAR, 8, 12, offsetof(mavlink_board_info_t, build_id) }, \
         } \
}
#else
#define MAVLINK_MESSAGE_INFO_BOARD_INFO { \
    "BOARD_INFO", \
    5, \
    {  { "dialect_hash", NULL, MAVLINK_TYPE_UINT32_T, 0, 0, offsetof(mavlink_board_info_t, dialect_hash) }, \
         { "parameter_hash", NULL, MAVLINK_TYPE_UINT32_T, 0, 4, offsetof(mavlink_board_info_t, parameter_hash) }, \
         { "pwm_top_counts", NULL, MAVLINK_TYPE_UINT16_T, 0, 8, offsetof(mavlink_board_info_t, pwm_top_counts) }, \
         { "tick_us", NULL, MAVLINK_TYPE_UINT16_T, 0, 10, offsetof(mavlink_board_info_t, tick_us) }, \
         { "build_id", NULL, MAVLINK_TYPE_CHAR, 8, 12, offsetof(mavlink_board_info_t, build_id) }, \
         } \
}
#endif

/**
 * @brief Pack a board_info message
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param msg The MAVLink message to compress the data into
 *
 * @param dialect_hash  Hash of the dialect compiled into the board.
 * @param parameter_hash  Hash over names and values of all parameters in force.
 * @param pwm_top_counts  PWM counts at full duty.
 * @param tick_us [us] Period of the control tick.
 * @param build_id  Hash of the firmware's sources, first eight hexadecimal digits.
 * @return length of the message in bytes (excluding serial stream start sign)
 */
static inline uint16_t mavlink_msg_board_info_pack(uint8_t system_id, uint8_t component_id, mavlink_message_t* msg,
                               uint32_t dialect_hash, uint32_t parameter_hash, uint16_t pwm_top_counts, uint16_t tick_us, const char *build_id)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_BOARD_INFO_LEN];
    _mav_put_uint32_t(buf, 0, dialect_hash);
    _mav_put_uint32_t(buf, 4, parameter_hash);
    _mav_put_uint16_t(buf, 8, pwm_top_counts);
    _mav_put_uint16_t(buf, 10, tick_us);
    _mav_put_char_array(buf, 12, build_id, 8);
        memcpy(_MAV_PAYLOAD_NON_CONST(msg), buf, MAVLINK_MSG_ID_BOARD_INFO_LEN);
#else
    mavlink_board_info_t packet;
    packet.dialect_hash = dialect_hash;
    packet.parameter_hash = parameter_hash;
    packet.pwm_top_counts = pwm_top_counts;
    packet.tick_us = tick_us;
    mav_array_memcpy(packet.build_id, build_id, sizeof(char)*8);
        memcpy(_MAV_PAYLOAD_NON_CONST(msg), &packet, MAVLINK_MSG_ID_BOARD_INFO_LEN);
#endif

    msg->msgid = MAVLINK_MSG_ID_BOARD_INFO;
    return mavlink_finalize_message(msg, system_id, component_id, MAVLINK_MSG_ID_BOARD_INFO_MIN_LEN, MAVLINK_MSG_ID_BOARD_INFO_LEN, MAVLINK_MSG_ID_BOARD_INFO_CRC);
}

/**
 * @brief Pack a board_info message
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param status MAVLink status structure
 * @param msg The MAVLink message to compress the data into
 *
 * @param dialect_hash  Hash of the dialect compiled into the board.
 * @param parameter_hash  Hash over names and values of all parameters in force.
 * @param pwm_top_counts  PWM counts at full duty.
 * @param tick_us [us] Period of the control tick.
 * @param build_id  Hash of the firmware's sources, first eight hexadecimal digits.
 * @return length of the message in bytes (excluding serial stream start sign)
 */
static inline uint16_t mavlink_msg_board_info_pack_status(uint8_t system_id, uint8_t component_id, mavlink_status_t *_status, mavlink_message_t* msg,
                               uint32_t dialect_hash, uint32_t parameter_hash, uint16_t pwm_top_counts, uint16_t tick_us, const char *build_id)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_BOARD_INFO_LEN];
    _mav_put_uint32_t(buf, 0, dialect_hash);
    _mav_put_uint32_t(buf, 4, parameter_hash);
    _mav_put_uint16_t(buf, 8, pwm_top_counts);
    _mav_put_uint16_t(buf, 10, tick_us);
    _mav_put_char_array(buf, 12, build_id, 8);
        memcpy(_MAV_PAYLOAD_NON_CONST(msg), buf, MAVLINK_MSG_ID_BOARD_INFO_LEN);
#else
    mavlink_board_info_t packet;
    packet.dialect_hash = dialect_hash;
    packet.parameter_hash = parameter_hash;
    packet.pwm_top_counts = pwm_top_counts;
    packet.tick_us = tick_us;
    mav_array_memcpy(packet.build_id, build_id, sizeof(char)*8);
        memcpy(_MAV_PAYLOAD_NON_CONST(msg), &packet, MAVLINK_MSG_ID_BOARD_INFO_LEN);
#endif

    msg->msgid = MAVLINK_MSG_ID_BOARD_INFO;
#if MAVLINK_CRC_EXTRA
    return mavlink_finalize_message_buffer(msg, system_id, component_id, _status, MAVLINK_MSG_ID_BOARD_INFO_MIN_LEN, MAVLINK_MSG_ID_BOARD_INFO_LEN, MAVLINK_MSG_ID_BOARD_INFO_CRC);
#else
    return mavlink_finalize_message_buffer(msg, system_id, component_id, _status, MAVLINK_MSG_ID_BOARD_INFO_MIN_LEN, MAVLINK_MSG_ID_BOARD_INFO_LEN);
#endif
}

/**
 * @brief Pack a board_info message on a channel
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param chan The MAVLink channel this message will be sent over
 * @param msg The MAVLink message to compress the data into
 * @param dialect_hash  Hash of the dialect compiled into the board.
 * @param parameter_hash  Hash over names and values of all parameters in force.
 * @param pwm_top_counts  PWM counts at full duty.
 * @param tick_us [us] Period of the control tick.
 * @param build_id  Hash of the firmware's sources, first eight hexadecimal digits.
 * @return length of the message in bytes (excluding serial stream start sign)
 */
static inline uint16_t mavlink_msg_board_info_pack_chan(uint8_t system_id, uint8_t component_id, uint8_t chan,
                               mavlink_message_t* msg,
                                   uint32_t dialect_hash,uint32_t parameter_hash,uint16_t pwm_top_counts,uint16_t tick_us,const char *build_id)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_BOARD_INFO_LEN];
    _mav_put_uint32_t(buf, 0, dialect_hash);
    _mav_put_uint32_t(buf, 4, parameter_hash);
    _mav_put_uint16_t(buf, 8, pwm_top_counts);
    _mav_put_uint16_t(buf, 10, tick_us);
    _mav_put_char_array(buf, 12, build_id, 8);
        memcpy(_MAV_PAYLOAD_NON_CONST(msg), buf, MAVLINK_MSG_ID_BOARD_INFO_LEN);
#else
    mavlink_board_info_t packet;
    packet.dialect_hash = dialect_hash;
    packet.parameter_hash = parameter_hash;
    packet.pwm_top_counts = pwm_top_counts;
    packet.tick_us = tick_us;
    mav_array_memcpy(packet.build_id, build_id, sizeof(char)*8);
        memcpy(_MAV_PAYLOAD_NON_CONST(msg), &packet, MAVLINK_MSG_ID_BOARD_INFO_LEN);
#endif

    msg->msgid = MAVLINK_MSG_ID_BOARD_INFO;
    return mavlink_finalize_message_chan(msg, system_id, component_id, chan, MAVLINK_MSG_ID_BOARD_INFO_MIN_LEN, MAVLINK_MSG_ID_BOARD_INFO_LEN, MAVLINK_MSG_ID_BOARD_INFO_CRC);
}

/**
 * @brief Encode a board_info struct
 *
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param msg The MAVLink message to compress the data into
 * @param board_info C-struct to read the message contents from
 */
static inline uint16_t mavlink_msg_board_info_encode(uint8_t system_id, uint8_t component_id, mavlink_message_t* msg, const mavlink_board_info_t* board_info)
{
    return mavlink_msg_board_info_pack(system_id, component_id, msg, board_info->dialect_hash, board_info->parameter_hash, board_info->pwm_top_counts, board_info->tick_us, board_info->build_id);
}

/**
 * @brief Encode a board_info struct on a channel
 *
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param chan The MAVLink channel this message will be sent over
 * @param msg The MAVLink message to compress the data into
 * @param board_info C-struct to read the message contents from
 */
static inline uint16_t mavlink_msg_board_info_encode_chan(uint8_t system_id, uint8_t component_id, uint8_t chan, mavlink_message_t* msg, const mavlink_board_info_t* board_info)
{
    return mavlink_msg_board_info_pack_chan(system_id, component_id, chan, msg, board_info->dialect_hash, board_info->parameter_hash, board_info->pwm_top_counts, board_info->tick_us, board_info->build_id);
}

/**
 * @brief Encode a board_info struct with provided status structure
 *
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param status MAVLink status structure
 * @param msg The MAVLink message to compress the data into
 * @param board_info C-struct to read the message contents from
 */
static inline uint16_t mavlink_msg_board_info_encode_status(uint8_t system_id, uint8_t component_id, mavlink_status_t* _status, mavlink_message_t* msg, const mavlink_board_info_t* board_info)
{
    return mavlink_msg_board_info_pack_status(system_id, component_id, _status, msg,  board_info->dialect_hash, board_info->parameter_hash, board_info->pwm_top_counts, board_info->tick_us, board_info->build_id);
}

/**
 * @brief Send a board_info message
 * @param chan MAVLink channel to send the message
 *
 * @param dialect_hash  Hash of the dialect compiled into the board.
 * @param parameter_hash  Hash over names and values of all parameters in force.
 * @param pwm_top_counts  PWM counts at full duty.
 * @param tick_us [us] Period of the control tick.
 * @param build_id  Hash of the firmware's sources, first eight hexadecimal digits.
 */
#ifdef MAVLINK_USE_CONVENIENCE_FUNCTIONS

static inline void mavlink_msg_board_info_send(mavlink_channel_t chan, uint32_t dialect_hash, uint32_t parameter_hash, uint16_t pwm_top_counts, uint16_t tick_us, const char *build_id)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_BOARD_INFO_LEN];
    _mav_put_uint32_t(buf, 0, dialect_hash);
    _mav_put_uint32_t(buf, 4, parameter_hash);
    _mav_put_uint16_t(buf, 8, pwm_top_counts);
    _mav_put_uint16_t(buf, 10, tick_us);
    _mav_put_char_array(buf, 12, build_id, 8);
    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_BOARD_INFO, buf, MAVLINK_MSG_ID_BOARD_INFO_MIN_LEN, MAVLINK_MSG_ID_BOARD_INFO_LEN, MAVLINK_MSG_ID_BOARD_INFO_CRC);
#else
    mavlink_board_info_t packet;
    packet.dialect_hash = dialect_hash;
    packet.parameter_hash = parameter_hash;
    packet.pwm_top_counts = pwm_top_counts;
    packet.tick_us = tick_us;
    mav_array_memcpy(packet.build_id, build_id, sizeof(char)*8);
    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_BOARD_INFO, (const char *)&packet, MAVLINK_MSG_ID_BOARD_INFO_MIN_LEN, MAVLINK_MSG_ID_BOARD_INFO_LEN, MAVLINK_MSG_ID_BOARD_INFO_CRC);
#endif
}

/**
 * @brief Send a board_info message
 * @param chan MAVLink channel to send the message
 * @param struct The MAVLink struct to serialize
 */
static inline void mavlink_msg_board_info_send_struct(mavlink_channel_t chan, const mavlink_board_info_t* board_info)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    mavlink_msg_board_info_send(chan, board_info->dialect_hash, board_info->parameter_hash, board_info->pwm_top_counts, board_info->tick_us, board_info->build_id);
#else
    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_BOARD_INFO, (const char *)board_info, MAVLINK_MSG_ID_BOARD_INFO_MIN_LEN, MAVLINK_MSG_ID_BOARD_INFO_LEN, MAVLINK_MSG_ID_BOARD_INFO_CRC);
#endif
}

#if MAVLINK_MSG_ID_BOARD_INFO_LEN <= MAVLINK_MAX_PAYLOAD_LEN
/*
  This variant of _send() can be used to save stack space by reusing
  memory from the receive buffer.  The caller provides a
  mavlink_message_t which is the size of a full mavlink message. This
  is usually the receive buffer for the channel, and allows a reply to an
  incoming message with minimum stack space usage.
 */
static inline void mavlink_msg_board_info_send_buf(mavlink_message_t *msgbuf, mavlink_channel_t chan,  uint32_t dialect_hash, uint32_t parameter_hash, uint16_t pwm_top_counts, uint16_t tick_us, const char *build_id)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char *buf = (char *)msgbuf;
    _mav_put_uint32_t(buf, 0, dialect_hash);
    _mav_put_uint32_t(buf, 4, parameter_hash);
    _mav_put_uint16_t(buf, 8, pwm_top_counts);
    _mav_put_uint16_t(buf, 10, tick_us);
    _mav_put_char_array(buf, 12, build_id, 8);
    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_BOARD_INFO, buf, MAVLINK_MSG_ID_BOARD_INFO_MIN_LEN, MAVLINK_MSG_ID_BOARD_INFO_LEN, MAVLINK_MSG_ID_BOARD_INFO_CRC);
#else
    mavlink_board_info_t *packet = (mavlink_board_info_t *)msgbuf;
    packet->dialect_hash = dialect_hash;
    packet->parameter_hash = parameter_hash;
    packet->pwm_top_counts = pwm_top_counts;
    packet->tick_us = tick_us;
    mav_array_memcpy(packet->build_id, build_id, sizeof(char)*8);
    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_BOARD_INFO, (const char *)packet, MAVLINK_MSG_ID_BOARD_INFO_MIN_LEN, MAVLINK_MSG_ID_BOARD_INFO_LEN, MAVLINK_MSG_ID_BOARD_INFO_CRC);
#endif
}
#endif

#endif

// MESSAGE BOARD_INFO UNPACKING


/**
 * @brief Get field dialect_hash from board_info message
 *
 * @return  Hash of the dialect compiled into the board.
 */
static inline uint32_t mavlink_msg_board_info_get_dialect_hash(const mavlink_message_t* msg)
{
    return _MAV_RETURN_uint32_t(msg,  0);
}

/**
 * @brief Get field parameter_hash from board_info message
 *
 * @return  Hash over names and values of all parameters in force.
 */
static inline uint32_t mavlink_msg_board_info_get_parameter_hash(const mavlink_message_t* msg)
{
    return _MAV_RETURN_uint32_t(msg,  4);
}

/**
 * @brief Get field pwm_top_counts from board_info message
 *
 * @return  PWM counts at full duty.
 */
static inline uint16_t mavlink_msg_board_info_get_pwm_top_counts(const mavlink_message_t* msg)
{
    return _MAV_RETURN_uint16_t(msg,  8);
}

/**
 * @brief Get field tick_us from board_info message
 *
 * @return [us] Period of the control tick.
 */
static inline uint16_t mavlink_msg_board_info_get_tick_us(const mavlink_message_t* msg)
{
    return _MAV_RETURN_uint16_t(msg,  10);
}

/**
 * @brief Get field build_id from board_info message
 *
 * @return  Hash of the firmware's sources, first eight hexadecimal digits.
 */
static inline uint16_t mavlink_msg_board_info_get_build_id(const mavlink_message_t* msg, char *build_id)
{
    return _MAV_RETURN_char_array(msg, build_id, 8,  12);
}

/**
 * @brief Decode a board_info message into a struct
 *
 * @param msg The message to decode
 * @param board_info C-struct to decode the message contents into
 */
static inline void mavlink_msg_board_info_decode(const mavlink_message_t* msg, mavlink_board_info_t* board_info)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    board_info->dialect_hash = mavlink_msg_board_info_get_dialect_hash(msg);
    board_info->parameter_hash = mavlink_msg_board_info_get_parameter_hash(msg);
    board_info->pwm_top_counts = mavlink_msg_board_info_get_pwm_top_counts(msg);
    board_info->tick_us = mavlink_msg_board_info_get_tick_us(msg);
    mavlink_msg_board_info_get_build_id(msg, board_info->build_id);
#else
        uint8_t len = msg->len < MAVLINK_MSG_ID_BOARD_INFO_LEN? msg->len : MAVLINK_MSG_ID_BOARD_INFO_LEN;
        memset(board_info, 0, MAVLINK_MSG_ID_BOARD_INFO_LEN);
    memcpy(board_info, _MAV_PAYLOAD(msg), len);
#endif
}
