/** @file
 *  @brief MAVLink comm protocol generated from hil.xml
 *  @see http://mavlink.org
 */
#pragma once
#ifndef MAVLINK_HIL_H
#define MAVLINK_HIL_H

#ifndef MAVLINK_H
    #error Wrong include order: MAVLINK_HIL.H MUST NOT BE DIRECTLY USED. Include mavlink.h from the same directory instead or set ALL AND EVERY defines from MAVLINK.H manually accordingly, including the #define MAVLINK_H call.
#endif

#define MAVLINK_HIL_XML_HASH -6819473695809293719

#ifdef __cplusplus
extern "C" {
#endif

// MESSAGE LENGTHS AND CRCS

#ifndef MAVLINK_MESSAGE_LENGTHS
#define MAVLINK_MESSAGE_LENGTHS {}
#endif

#ifndef MAVLINK_MESSAGE_CRCS
#define MAVLINK_MESSAGE_CRCS {{0, 50, 9, 9, 0, 0, 0}, {1, 124, 31, 31, 0, 0, 0}, {20, 214, 20, 20, 3, 2, 3}, {21, 159, 2, 2, 3, 0, 1}, {22, 220, 25, 25, 0, 0, 0}, {23, 168, 23, 23, 3, 4, 5}, {76, 152, 33, 33, 3, 30, 31}, {77, 143, 3, 3, 0, 0, 0}, {111, 34, 16, 16, 0, 0, 0}, {253, 83, 51, 54, 0, 0, 0}, {256, 71, 42, 42, 3, 8, 9}, {24100, 132, 10, 10, 0, 0, 0}, {24101, 103, 49, 49, 0, 0, 0}, {24102, 225, 20, 20, 0, 0, 0}}
#endif

#include "../protocol.h"

#define MAVLINK_ENABLED_HIL

// ENUM DEFINITIONS


/** @brief State of the board's safety supervisor. */
#ifndef HAVE_ENUM_HIL_STATE
#define HAVE_ENUM_HIL_STATE
typedef enum HIL_STATE
{
   HIL_STATE_DISARMED=0, /* Wheels off; set-points are refused. | */
   HIL_STATE_ARMED=1, /* The wheel loops follow the set-points. | */
   HIL_STATE_SAFE=2, /* Wheels off after a fault or stop; only a new arming leaves it. | */
   HIL_STATE_ENUM_END=3, /*  | */
} HIL_STATE;
#endif

/** @brief Why the board is in its state; the lowest value wins when several hold. */
#ifndef HAVE_ENUM_HIL_REASON
#define HAVE_ENUM_HIL_REASON
typedef enum HIL_REASON
{
   HIL_REASON_NONE=0, /* No fault since start or arming. | */
   HIL_REASON_STOP_COMMAND=1, /* The host ordered an emergency stop. | */
   HIL_REASON_RUNAWAY_LEFT=2, /* Left counts run against the left PWM: phases or motor leads swapped. | */
   HIL_REASON_RUNAWAY_RIGHT=3, /* Right counts run against the right PWM: phases or motor leads swapped. | */
   HIL_REASON_OVERSPEED_LEFT=4, /* Left wheel beyond the overspeed limit. | */
   HIL_REASON_OVERSPEED_RIGHT=5, /* Right wheel beyond the overspeed limit. | */
   HIL_REASON_STALL_LEFT=6, /* Left PWM high and no counts: wheel blocked or encoder dead. | */
   HIL_REASON_STALL_RIGHT=7, /* Right PWM high and no counts: wheel blocked or encoder dead. | */
   HIL_REASON_ENCODER=8, /* Too many illegal transitions of the encoder signals. | */
   HIL_REASON_SETPOINT_TIMEOUT=9, /* No valid set-point for the time allowed. | */
   HIL_REASON_BATTERY_LOW=10, /* Battery below its limit for longer than the debounce time. | */
   HIL_REASON_ENUM_END=11, /*  | */
} HIL_REASON;
#endif

/** @brief Flags of WHEEL_STATE. */
#ifndef HAVE_ENUM_HIL_WHEEL_FLAG
#define HAVE_ENUM_HIL_WHEEL_FLAG
typedef enum HIL_WHEEL_FLAG
{
   HIL_WHEEL_FLAG_SATURATED_LEFT=1, /* Left output is held by the PWM or slew limit. | */
   HIL_WHEEL_FLAG_SATURATED_RIGHT=2, /* Right output is held by the PWM or slew limit. | */
   HIL_WHEEL_FLAG_HOLD_LEFT=4, /* Left wheel at rest on a zero set-point, bridge off. | */
   HIL_WHEEL_FLAG_HOLD_RIGHT=8, /* Right wheel at rest on a zero set-point, bridge off. | */
   HIL_WHEEL_FLAG_PID=16, /* The PID benchmark is the active wheel law, otherwise ASG-ISM. | */
   HIL_WHEEL_FLAG_BATTERY_LOW=32, /* The debounced battery check is low. | */
   HIL_WHEEL_FLAG_ENUM_END=33, /*  | */
} HIL_WHEEL_FLAG;
#endif

/** @brief The commands the board knows; all others are answered UNSUPPORTED. */
#ifndef HAVE_ENUM_MAV_CMD
#define HAVE_ENUM_MAV_CMD
typedef enum MAV_CMD
{
   MAV_CMD_DO_FLIGHTTERMINATION=185, /* Emergency stop: wheels off, state SAFE. |1 to stop| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)|  */
   MAV_CMD_PREFLIGHT_STORAGE=245, /* Parameter storage, refused while armed. |1: store the parameters; 2: back to defaults| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)|  */
   MAV_CMD_COMPONENT_ARM_DISARM=400, /* Arm or disarm. Arming must present the hashes of BOARD_INFO as 16-bit halves, which a float carries exactly. |0: disarm, 1: arm| not used| dialect hash, upper half| dialect hash, lower half| parameter hash, upper half| parameter hash, lower half| not used|  */
   MAV_CMD_REQUEST_MESSAGE=512, /* Send one message now: BOARD_INFO, SYS_STATUS or HEARTBEAT. |message id| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)| Reserved (default:0)|  */
   MAV_CMD_ENUM_END=513, /*  | */
} MAV_CMD;
#endif

/** @brief Result of a command. */
#ifndef HAVE_ENUM_MAV_RESULT
#define HAVE_ENUM_MAV_RESULT
typedef enum MAV_RESULT
{
   MAV_RESULT_ACCEPTED=0, /*  | */
   MAV_RESULT_TEMPORARILY_REJECTED=1, /*  | */
   MAV_RESULT_DENIED=2, /*  | */
   MAV_RESULT_UNSUPPORTED=3, /*  | */
   MAV_RESULT_FAILED=4, /*  | */
   MAV_RESULT_IN_PROGRESS=5, /*  | */
   MAV_RESULT_ENUM_END=6, /*  | */
} MAV_RESULT;
#endif

/** @brief Type of a parameter; the board has 32-bit floats only. */
#ifndef HAVE_ENUM_MAV_PARAM_TYPE
#define HAVE_ENUM_MAV_PARAM_TYPE
typedef enum MAV_PARAM_TYPE
{
   MAV_PARAM_TYPE_REAL32=9, /*  | */
   MAV_PARAM_TYPE_ENUM_END=10, /*  | */
} MAV_PARAM_TYPE;
#endif

/** @brief Severity of a status text (RFC 5424). */
#ifndef HAVE_ENUM_MAV_SEVERITY
#define HAVE_ENUM_MAV_SEVERITY
typedef enum MAV_SEVERITY
{
   MAV_SEVERITY_EMERGENCY=0, /*  | */
   MAV_SEVERITY_ALERT=1, /*  | */
   MAV_SEVERITY_CRITICAL=2, /*  | */
   MAV_SEVERITY_ERROR=3, /*  | */
   MAV_SEVERITY_WARNING=4, /*  | */
   MAV_SEVERITY_NOTICE=5, /*  | */
   MAV_SEVERITY_INFO=6, /*  | */
   MAV_SEVERITY_DEBUG=7, /*  | */
   MAV_SEVERITY_ENUM_END=8, /*  | */
} MAV_SEVERITY;
#endif

/** @brief The two subsystems the board has. */
#ifndef HAVE_ENUM_MAV_SYS_STATUS_SENSOR
#define HAVE_ENUM_MAV_SYS_STATUS_SENSOR
typedef enum MAV_SYS_STATUS_SENSOR
{
   MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS=32768, /*  | */
   MAV_SYS_STATUS_SENSOR_BATTERY=33554432, /*  | */
   MAV_SYS_STATUS_SENSOR_ENUM_END=33554433, /*  | */
} MAV_SYS_STATUS_SENSOR;
#endif

// MAVLINK VERSION

#ifndef MAVLINK_VERSION
#define MAVLINK_VERSION 3
#endif

#if (MAVLINK_VERSION == 0)
#undef MAVLINK_VERSION
#define MAVLINK_VERSION 3
#endif

// MESSAGE DEFINITIONS
#include "./mavlink_msg_sys_status.h"
#include "./mavlink_msg_param_request_read.h"
#include "./mavlink_msg_param_request_list.h"
#include "./mavlink_msg_param_value.h"
#include "./mavlink_msg_param_set.h"
#include "./mavlink_msg_command_long.h"
#include "./mavlink_msg_command_ack.h"
#include "./mavlink_msg_timesync.h"
#include "./mavlink_msg_statustext.h"
#include "./mavlink_msg_setup_signing.h"
#include "./mavlink_msg_wheel_setpoint.h"
#include "./mavlink_msg_wheel_state.h"
#include "./mavlink_msg_board_info.h"

// base include
#include "../minimal/minimal.h"


#if MAVLINK_HIL_XML_HASH == MAVLINK_PRIMARY_XML_HASH
# define MAVLINK_MESSAGE_INFO {MAVLINK_MESSAGE_INFO_HEARTBEAT, MAVLINK_MESSAGE_INFO_SYS_STATUS, MAVLINK_MESSAGE_INFO_PARAM_REQUEST_READ, MAVLINK_MESSAGE_INFO_PARAM_REQUEST_LIST, MAVLINK_MESSAGE_INFO_PARAM_VALUE, MAVLINK_MESSAGE_INFO_PARAM_SET, MAVLINK_MESSAGE_INFO_COMMAND_LONG, MAVLINK_MESSAGE_INFO_COMMAND_ACK, MAVLINK_MESSAGE_INFO_TIMESYNC, MAVLINK_MESSAGE_INFO_STATUSTEXT, MAVLINK_MESSAGE_INFO_SETUP_SIGNING, MAVLINK_MESSAGE_INFO_WHEEL_SETPOINT, MAVLINK_MESSAGE_INFO_WHEEL_STATE, MAVLINK_MESSAGE_INFO_BOARD_INFO}
# define MAVLINK_MESSAGE_NAMES {{ "BOARD_INFO", 24102 }, { "COMMAND_ACK", 77 }, { "COMMAND_LONG", 76 }, { "HEARTBEAT", 0 }, { "PARAM_REQUEST_LIST", 21 }, { "PARAM_REQUEST_READ", 20 }, { "PARAM_SET", 23 }, { "PARAM_VALUE", 22 }, { "SETUP_SIGNING", 256 }, { "STATUSTEXT", 253 }, { "SYS_STATUS", 1 }, { "TIMESYNC", 111 }, { "WHEEL_SETPOINT", 24100 }, { "WHEEL_STATE", 24101 }}
# if MAVLINK_COMMAND_24BIT
#  include "../mavlink_get_info.h"
# endif
#endif

#ifdef __cplusplus
}
#endif // __cplusplus
#endif // MAVLINK_HIL_H
