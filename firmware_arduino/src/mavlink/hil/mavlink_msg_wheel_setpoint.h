#pragma once
// MESSAGE WHEEL_SETPOINT PACKING

#include <stdint.h>

#define MAVLINK_MSG_ID_WHEEL_SETPOINT 24100


typedef struct __mavlink_wheel_setpoint_t {
 float omega_left_rad_s; /*< [rad/s] Left wheels, positive drives forward.*/
 float omega_right_rad_s; /*< [rad/s] Right wheels, positive drives forward.*/
 uint16_t seq; /*<  Rises by one with every set-point and wraps.*/
} mavlink_wheel_setpoint_t;

#define MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN 10
#define MAVLINK_MSG_ID_WHEEL_SETPOINT_MIN_LEN 10
#define MAVLINK_MSG_ID_24100_LEN 10
#define MAVLINK_MSG_ID_24100_MIN_LEN 10

#define MAVLINK_MSG_ID_WHEEL_SETPOINT_CRC 132
#define MAVLINK_MSG_ID_24100_CRC 132



#if MAVLINK_COMMAND_24BIT
#define MAVLINK_MESSAGE_INFO_WHEEL_SETPOINT { \
    24100, \
    "WHEEL_SETPOINT", \
    3, \
    {  { "omega_left_rad_s", NULL, MAVLINK_TYPE_FLOAT, 0, 0, offsetof(mavlink_wheel_setpoint_t, omega_left_rad_s) }, \
         { "omega_right_rad_s", NULL, MAVLINK_TYPE_FLOAT, 0, 4, offsetof(mavlink_wheel_setpoint_t, omega_right_rad_s) }, \
         { "seq", NULL, MAVLINK_TYPE_UINT16_T, 0, 8, offsetof(mavlink_wheel_setpoint_t, seq) }, \
         } \
}
#else
#define MAVLINK_MESSAGE_INFO_WHEEL_SETPOINT { \
    "WHEEL_SETPOINT", \
    3, \
    {  { "omega_left_rad_s", NULL, MAVLINK_TYPE_FLOAT, 0, 0, offsetof(mavlink_wheel_setpoint_t, omega_left_rad_s) }, \
         { "omega_right_rad_s", NULL, MAVLINK_TYPE_FLOAT, 0, 4, offsetof(mavlink_wheel_setpoint_t, omega_right_rad_s) }, \
         { "seq", NULL, MAVLINK_TYPE_UINT16_T, 0, 8, offsetof(mavlink_wheel_setpoint_t, seq) }, \
         } \
}
#endif

/**
 * @brief Pack a wheel_setpoint message
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param msg The MAVLink message to compress the data into
 *
 * @param omega_left_rad_s [rad/s] Left wheels, positive drives forward.
 * @param omega_right_rad_s [rad/s] Right wheels, positive drives forward.
 * @param seq  Rises by one with every set-point and wraps.
 * @return length of the message in bytes (excluding serial stream start sign)
 */
static inline uint16_t mavlink_msg_wheel_setpoint_pack(uint8_t system_id, uint8_t component_id, mavlink_message_t* msg,
                               float omega_left_rad_s, float omega_right_rad_s, uint16_t seq)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN];
    _mav_put_float(buf, 0, omega_left_rad_s);
    _mav_put_float(buf, 4, omega_right_rad_s);
    _mav_put_uint16_t(buf, 8, seq);

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), buf, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN);
#else
    mavlink_wheel_setpoint_t packet;
    packet.omega_left_rad_s = omega_left_rad_s;
    packet.omega_right_rad_s = omega_right_rad_s;
    packet.seq = seq;

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), &packet, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN);
#endif

    msg->msgid = MAVLINK_MSG_ID_WHEEL_SETPOINT;
    return mavlink_finalize_message(msg, system_id, component_id, MAVLINK_MSG_ID_WHEEL_SETPOINT_MIN_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_CRC);
}

/**
 * @brief Pack a wheel_setpoint message
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param status MAVLink status structure
 * @param msg The MAVLink message to compress the data into
 *
 * @param omega_left_rad_s [rad/s] Left wheels, positive drives forward.
 * @param omega_right_rad_s [rad/s] Right wheels, positive drives forward.
 * @param seq  Rises by one with every set-point and wraps.
 * @return length of the message in bytes (excluding serial stream start sign)
 */
static inline uint16_t mavlink_msg_wheel_setpoint_pack_status(uint8_t system_id, uint8_t component_id, mavlink_status_t *_status, mavlink_message_t* msg,
                               float omega_left_rad_s, float omega_right_rad_s, uint16_t seq)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN];
    _mav_put_float(buf, 0, omega_left_rad_s);
    _mav_put_float(buf, 4, omega_right_rad_s);
    _mav_put_uint16_t(buf, 8, seq);

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), buf, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN);
#else
    mavlink_wheel_setpoint_t packet;
    packet.omega_left_rad_s = omega_left_rad_s;
    packet.omega_right_rad_s = omega_right_rad_s;
    packet.seq = seq;

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), &packet, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN);
#endif

    msg->msgid = MAVLINK_MSG_ID_WHEEL_SETPOINT;
#if MAVLINK_CRC_EXTRA
    return mavlink_finalize_message_buffer(msg, system_id, component_id, _status, MAVLINK_MSG_ID_WHEEL_SETPOINT_MIN_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_CRC);
#else
    return mavlink_finalize_message_buffer(msg, system_id, component_id, _status, MAVLINK_MSG_ID_WHEEL_SETPOINT_MIN_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN);
#endif
}

/**
 * @brief Pack a wheel_setpoint message on a channel
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param chan The MAVLink channel this message will be sent over
 * @param msg The MAVLink message to compress the data into
 * @param omega_left_rad_s [rad/s] Left wheels, positive drives forward.
 * @param omega_right_rad_s [rad/s] Right wheels, positive drives forward.
 * @param seq  Rises by one with every set-point and wraps.
 * @return length of the message in bytes (excluding serial stream start sign)
 */
static inline uint16_t mavlink_msg_wheel_setpoint_pack_chan(uint8_t system_id, uint8_t component_id, uint8_t chan,
                               mavlink_message_t* msg,
                                   float omega_left_rad_s,float omega_right_rad_s,uint16_t seq)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN];
    _mav_put_float(buf, 0, omega_left_rad_s);
    _mav_put_float(buf, 4, omega_right_rad_s);
    _mav_put_uint16_t(buf, 8, seq);

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), buf, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN);
#else
    mavlink_wheel_setpoint_t packet;
    packet.omega_left_rad_s = omega_left_rad_s;
    packet.omega_right_rad_s = omega_right_rad_s;
    packet.seq = seq;

        memcpy(_MAV_PAYLOAD_NON_CONST(msg), &packet, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN);
#endif

    msg->msgid = MAVLINK_MSG_ID_WHEEL_SETPOINT;
    return mavlink_finalize_message_chan(msg, system_id, component_id, chan, MAVLINK_MSG_ID_WHEEL_SETPOINT_MIN_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_CRC);
}

/**
 * @brief Encode a wheel_setpoint struct
 *
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param msg The MAVLink message to compress the data into
 * @param wheel_setpoint C-struct to read the message contents from
 */
static inline uint16_t mavlink_msg_wheel_setpoint_encode(uint8_t system_id, uint8_t component_id, mavlink_message_t* msg, const mavlink_wheel_setpoint_t* wheel_setpoint)
{
    return mavlink_msg_wheel_setpoint_pack(system_id, component_id, msg, wheel_setpoint->omega_left_rad_s, wheel_setpoint->omega_right_rad_s, wheel_setpoint->seq);
}

/**
 * @brief Encode a wheel_setpoint struct on a channel
 *
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param chan The MAVLink channel this message will be sent over
 * @param msg The MAVLink message to compress the data into
 * @param wheel_setpoint C-struct to read the message contents from
 */
static inline uint16_t mavlink_msg_wheel_setpoint_encode_chan(uint8_t system_id, uint8_t component_id, uint8_t chan, mavlink_message_t* msg, const mavlink_wheel_setpoint_t* wheel_setpoint)
{
    return mavlink_msg_wheel_setpoint_pack_chan(system_id, component_id, chan, msg, wheel_setpoint->omega_left_rad_s, wheel_setpoint->omega_right_rad_s, wheel_setpoint->seq);
}

/**
 * @brief Encode a wheel_setpoint struct with provided status structure
 *
 * @param system_id ID of this system
 * @param component_id ID of this component (e.g. 200 for IMU)
 * @param status MAVLink status structure
 * @param msg The MAVLink message to compress the data into
 * @param wheel_setpoint C-struct to read the message contents from
 */
static inline uint16_t mavlink_msg_wheel_setpoint_encode_status(uint8_t system_id, uint8_t component_id, mavlink_status_t* _status, mavlink_message_t* msg, const mavlink_wheel_setpoint_t* wheel_setpoint)
{
    return mavlink_msg_wheel_setpoint_pack_status(system_id, component_id, _status, msg,  wheel_setpoint->omega_left_rad_s, wheel_setpoint->omega_right_rad_s, wheel_setpoint->seq);
}

/**
 * @brief Send a wheel_setpoint message
 * @param chan MAVLink channel to send the message
 *
 * @param omega_left_rad_s [rad/s] Left wheels, positive drives forward.
 * @param omega_right_rad_s [rad/s] Right wheels, positive drives forward.
 * @param seq  Rises by one with every set-point and wraps.
 */
#ifdef MAVLINK_USE_CONVENIENCE_FUNCTIONS

static inline void mavlink_msg_wheel_setpoint_send(mavlink_channel_t chan, float omega_left_rad_s, float omega_right_rad_s, uint16_t seq)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char buf[MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN];
    _mav_put_float(buf, 0, omega_left_rad_s);
    _mav_put_float(buf, 4, omega_right_rad_s);
    _mav_put_uint16_t(buf, 8, seq);

    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_WHEEL_SETPOINT, buf, MAVLINK_MSG_ID_WHEEL_SETPOINT_MIN_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_CRC);
#else
    mavlink_wheel_setpoint_t packet;
    packet.omega_left_rad_s = omega_left_rad_s;
    packet.omega_right_rad_s = omega_right_rad_s;
    packet.seq = seq;

    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_WHEEL_SETPOINT, (const char *)&packet, MAVLINK_MSG_ID_WHEEL_SETPOINT_MIN_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_CRC);
#endif
}

/**
 * @brief Send a wheel_setpoint message
 * @param chan MAVLink channel to send the message
 * @param struct The MAVLink struct to serialize
 */
static inline void mavlink_msg_wheel_setpoint_send_struct(mavlink_channel_t chan, const mavlink_wheel_setpoint_t* wheel_setpoint)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    mavlink_msg_wheel_setpoint_send(chan, wheel_setpoint->omega_left_rad_s, wheel_setpoint->omega_right_rad_s, wheel_setpoint->seq);
#else
    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_WHEEL_SETPOINT, (const char *)wheel_setpoint, MAVLINK_MSG_ID_WHEEL_SETPOINT_MIN_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_CRC);
#endif
}

#if MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN <= MAVLINK_MAX_PAYLOAD_LEN
/*
  This variant of _send() can be used to save stack space by reusing
  memory from the receive buffer.  The caller provides a
  mavlink_message_t which is the size of a full mavlink message. This
  is usually the receive buffer for the channel, and allows a reply to an
  incoming message with minimum stack space usage.
 */
static inline void mavlink_msg_wheel_setpoint_send_buf(mavlink_message_t *msgbuf, mavlink_channel_t chan,  float omega_left_rad_s, float omega_right_rad_s, uint16_t seq)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    char *buf = (char *)msgbuf;
    _mav_put_float(buf, 0, omega_left_rad_s);
    _mav_put_float(buf, 4, omega_right_rad_s);
    _mav_put_uint16_t(buf, 8, seq);

    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_WHEEL_SETPOINT, buf, MAVLINK_MSG_ID_WHEEL_SETPOINT_MIN_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_CRC);
#else
    mavlink_wheel_setpoint_t *packet = (mavlink_wheel_setpoint_t *)msgbuf;
    packet->omega_left_rad_s = omega_left_rad_s;
    packet->omega_right_rad_s = omega_right_rad_s;
    packet->seq = seq;

    _mav_finalize_message_chan_send(chan, MAVLINK_MSG_ID_WHEEL_SETPOINT, (const char *)packet, MAVLINK_MSG_ID_WHEEL_SETPOINT_MIN_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN, MAVLINK_MSG_ID_WHEEL_SETPOINT_CRC);
#endif
}
#endif

#endif

// MESSAGE WHEEL_SETPOINT UNPACKING


/**
 * @brief Get field omega_left_rad_s from wheel_setpoint message
 *
 * @return [rad/s] Left wheels, positive drives forward.
 */
static inline float mavlink_msg_wheel_setpoint_get_omega_left_rad_s(const mavlink_message_t* msg)
{
    return _MAV_RETURN_float(msg,  0);
}

/**
 * @brief Get field omega_right_rad_s from wheel_setpoint message
 *
 * @return [rad/s] Right wheels, positive drives forward.
 */
static inline float mavlink_msg_wheel_setpoint_get_omega_right_rad_s(const mavlink_message_t* msg)
{
    return _MAV_RETURN_float(msg,  4);
}

/**
 * @brief Get field seq from wheel_setpoint message
 *
 * @return  Rises by one with every set-point and wraps.
 */
static inline uint16_t mavlink_msg_wheel_setpoint_get_seq(const mavlink_message_t* msg)
{
    return _MAV_RETURN_uint16_t(msg,  8);
}

/**
 * @brief Decode a wheel_setpoint message into a struct
 *
 * @param msg The message to decode
 * @param wheel_setpoint C-struct to decode the message contents into
 */
static inline void mavlink_msg_wheel_setpoint_decode(const mavlink_message_t* msg, mavlink_wheel_setpoint_t* wheel_setpoint)
{
#if MAVLINK_NEED_BYTE_SWAP || !MAVLINK_ALIGNED_FIELDS
    wheel_setpoint->omega_left_rad_s = mavlink_msg_wheel_setpoint_get_omega_left_rad_s(msg);
    wheel_setpoint->omega_right_rad_s = mavlink_msg_wheel_setpoint_get_omega_right_rad_s(msg);
    wheel_setpoint->seq = mavlink_msg_wheel_setpoint_get_seq(msg);
#else
        uint8_t len = msg->len < MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN? msg->len : MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN;
        memset(wheel_setpoint, 0, MAVLINK_MSG_ID_WHEEL_SETPOINT_LEN);
    memcpy(wheel_setpoint, _MAV_PAYLOAD(msg), len);
#endif
}
