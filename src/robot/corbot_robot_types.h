/* SPDX-License-Identifier: Apache-2.0
 *
 * Argument and result types of the functions in corbot_robot.h. */
#ifndef CORBOT_ROBOT_TYPES_H
#define CORBOT_ROBOT_TYPES_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  CORBOT_MAX_JOINTS = 6,
  CORBOT_TEXT = 192,
  CORBOT_MAX_ALARMS = 64,
  CORBOT_LATENCY_BUCKETS = 64,
  CORBOT_MAX_SOLUTIONS = 16,
  CORBOT_JOINT_NAME = 64
};

/* Kinds of failure; each except the last two is an exception of robot.idl. */
typedef enum corbot_status {
  CORBOT_OK = 0,
  CORBOT_BAD_PARAMETER,  /* parameter, value, text */
  CORBOT_UNREACHABLE,    /* target_m, text */
  CORBOT_LIMIT_EXCEEDED, /* parameter = quantity, joint (-1: none), value, lower, upper, text */
  CORBOT_NOT_READY,      /* text */
  CORBOT_STOPPED,        /* text */
  CORBOT_QUEUE_FULL,     /* capacity, text */
  CORBOT_NO_DATA,        /* no real-time task has run yet; text */
  CORBOT_INTERNAL        /* text */
} corbot_status;

/* Strings are ASCII and terminated, never NULL. */
typedef struct corbot_error {
  corbot_status status;
  char parameter[256];
  int32_t joint;
  double value;
  double lower;
  double upper;
  double target_m[3];
  int32_t capacity;
  char text[CORBOT_TEXT];
} corbot_error;

typedef struct corbot_robot corbot_robot;
typedef uint64_t corbot_ticket;

typedef enum corbot_motion_state {
  CORBOT_MOTION_QUEUED,
  CORBOT_MOTION_RUNNING,
  CORBOT_MOTION_DONE,
  CORBOT_MOTION_STOPPED,
  CORBOT_MOTION_FAILED
} corbot_motion_state;

typedef struct corbot_motion_info {
  corbot_ticket id;
  corbot_motion_state state;
  double progress;   /* 0 .. 1 */
  double duration_s; /* planned, at override 100 % */
  char reason[CORBOT_TEXT];
} corbot_motion_info;

/* The order is that of robot.idl's enumerations. */
typedef enum corbot_gripper { CORBOT_GRIPPER_OPEN, CORBOT_GRIPPER_CLOSE } corbot_gripper;
typedef enum corbot_state { CORBOT_STATE_ERROR, CORBOT_STATE_WAITING, CORBOT_STATE_STANDBY } corbot_state;

/* Joint values, here and in corbot_robot.h: degrees and degrees/s for a rotary joint, metres and m/s for a
 * sliding one, see `slides`. Their arrays start at the base; elements beyond the arm's joints are 0. */

/* Properties that do not change while the servant runs. */
typedef struct corbot_description {
  char name[64];
  int32_t kind; /* order of RobotKind */
  int32_t dof;
  double lower[CORBOT_MAX_JOINTS];   /* degrees; m where the joint slides */
  double upper[CORBOT_MAX_JOINTS];   /* as lower */
  double speed[CORBOT_MAX_JOINTS];   /* speed limits, degrees/s; m/s where the joint slides */
  int32_t slides[CORBOT_MAX_JOINTS]; /* 1: the joint slides */
  char joint_name[CORBOT_MAX_JOINTS][CORBOT_JOINT_NAME];
  double reach_m;
  char endpoint_host[256]; /* the endpoint in the profile */
  int32_t endpoint_port;
  char version[32];     /* corbot's version */
  char fingerprint[20]; /* of the arm's model, 16 hexadecimal digits */
  double started_s;     /* when the robot was opened, since the Unix epoch */
} corbot_description;

typedef struct corbot_pose {
  double x_m, y_m, z_m;
  double a_deg, b_deg, c_deg; /* Z-Y-X of the tool frame, b positive upward */
} corbot_pose;

typedef struct corbot_alarm {
  double time_s; /* since the Unix epoch */
  int32_t code;
  int32_t active;
  char text[CORBOT_TEXT];
} corbot_alarm;

typedef struct corbot_loop_info {
  double period_s, since_s;
  uint64_t cycles, overruns;
  double latency_mean_s, latency_max_s, work_max_s;
  int32_t realtime;
  uint64_t counts[CORBOT_LATENCY_BUCKETS];
  double edges_s[CORBOT_LATENCY_BUCKETS];
} corbot_loop_info;

typedef enum corbot_device_health {
  CORBOT_DEVICE_CLOSED,
  CORBOT_DEVICE_OPEN,
  CORBOT_DEVICE_DEGRADED,
  CORBOT_DEVICE_LOST
} corbot_device_health;

/* The servos' controller. Ages are in seconds, 0 if there is no value. */
typedef struct corbot_device_info {
  char backend[32]; /* `kind` of the profile */
  corbot_device_health health;
  uint32_t cause; /* why it is degraded or lost; 0: it is neither */
  char cause_text[CORBOT_TEXT];
  uint64_t frames; /* number of frames that the device accepted */
  /* age: from the newest frame to its acceptance; age_max: the longest since the device was opened */
  double age_s, age_max_s;
  int32_t measured;            /* it measures positions */
  double measured_age_s;       /* age of the last measurement, now */
  int32_t position_unverified; /* the first motion is slow */
  int32_t emergency_stop;      /* active now */
} corbot_device_info;

typedef enum corbot_holding { CORBOT_HOLDING_UNKNOWN, CORBOT_HOLDING_NO, CORBOT_HOLDING_YES } corbot_holding;

/* Openings in percent, 0 closed. */
typedef struct corbot_gripper_info {
  double commanded_percent;
  int32_t measured;       /* the device measures the opening */
  double opening_percent; /* measured, else the set-point */
  corbot_holding holding;
} corbot_gripper_info;

/* Pose of the tool frame in the base frame. */
typedef struct corbot_tool_pose {
  double position_m[3];
  double orientation[4]; /* unit quaternion w, x, y, z; w is not negative */
} corbot_tool_pose;

/* The frame whose axes an offset of the tool refers to. */
typedef enum corbot_offset_frame { CORBOT_OFFSET_IN_BASE, CORBOT_OFFSET_IN_TOOL } corbot_offset_frame;

/* One of the arm's solutions at a pose. */
typedef struct corbot_pose_solution {
  uint32_t number;
  double joints[CORBOT_MAX_JOINTS]; /* degrees; m where the joint slides */
  int32_t in_range;                 /* within the ranges that motions keep, soft limits included */
  double orientation_error_deg;
} corbot_pose_solution;

/* Ranges of the joints, degrees; m where the joint slides. */
typedef struct corbot_joint_ranges {
  double lower[CORBOT_MAX_JOINTS];
  double upper[CORBOT_MAX_JOINTS];
} corbot_joint_ranges;

/* Owner of a limit, and the derivative that it bounds. */
typedef enum corbot_limit_owner {
  CORBOT_OWNER_JOINT,
  CORBOT_OWNER_TOOL,
  CORBOT_OWNER_TOOL_TURN
} corbot_limit_owner;
typedef enum corbot_limit_kind {
  CORBOT_LIMIT_SPEED,
  CORBOT_LIMIT_ACCELERATION,
  CORBOT_LIMIT_JERK
} corbot_limit_kind;

/* A stretch of a planned motion and the limit that is the nearest throughout. */
typedef struct corbot_plan_stretch {
  double begin_s; /* from the beginning of the part, at override 100 % */
  double end_s;
  int32_t owner; /* a corbot_limit_owner */
  int32_t joint; /* -1 where the owner is no joint */
  int32_t limit; /* a corbot_limit_kind */
  double share;  /* the greatest in this stretch, 0 to 1 of the value that a plan may use */
} corbot_plan_stretch;

/* A part of a planned motion: one of the two of a MoveC, else the whole motion. */
enum { CORBOT_MAX_FURTHER_SHAPES = 8, CORBOT_MAX_SHAPES = 24, CORBOT_SHAPE_NAME = 40 };

typedef enum corbot_shape_kind {
  CORBOT_SHAPE_PLANE,
  CORBOT_SHAPE_INSIDE, /* a box to stay in */
  CORBOT_SHAPE_OUTSIDE /* a box to stay out of */
} corbot_shape_kind;

/* A plane or box of the workspace, in the frame of all positions. */
typedef struct corbot_shape {
  char name[CORBOT_SHAPE_NAME];
  corbot_shape_kind kind;
  uint32_t parts;   /* a sum of 1 tool, 2 wrist, 4 elbow, 8 upper arm, 16 forearm, 32 hand */
  double normal[3]; /* of a plane, into the side where the parts stay */
  double offset_m;  /* of a plane from the origin, along the normal */
  double from_m[3]; /* of a box */
  double to_m[3];   /* greater than from_m */
} corbot_shape;

/* The profile's planes and boxes, and behind them those that are set. */
typedef struct corbot_workspace {
  int32_t known; /* 0: those that are set are not known or hold for another base frame. No joint moves then */
  size_t profile_count;
  size_t further_count;
  corbot_shape shapes[CORBOT_MAX_SHAPES];
} corbot_workspace;

enum { CORBOT_MAX_STRETCHES = 100, CORBOT_MAX_PARTS = 2 };
typedef struct corbot_plan_part {
  double duration_s; /* at override 100 % */
  size_t stretch_count;
  corbot_plan_stretch stretches[CORBOT_MAX_STRETCHES];
  int32_t has_pivot;
  double least_pivot; /* 0: through a singularity */
  double pivot_point_m[3];
} corbot_plan_part;

typedef struct corbot_plan {
  double start[CORBOT_MAX_JOINTS]; /* degrees; m where the joint slides */
  double end[CORBOT_MAX_JOINTS];
  size_t part_count;
  corbot_plan_part parts[CORBOT_MAX_PARTS];
} corbot_plan;

/* Whether the client of a call is still waiting for its result. */
typedef enum corbot_presence {
  CORBOT_CALLER_GONE,
  CORBOT_CALLER_PRESENT,
  /* connected, but too many calls of its host take long: this call has to end */
  CORBOT_CALLER_CROWDED
} corbot_presence;

/* A Stop or StopAndHold that was counted when its request arrived, see corbot_robot_count_stop. */
typedef struct corbot_counted_stop {
  int32_t counted; /* 0: not counted */
  uint64_t number;
  uint64_t last; /* number of the last command that was planned before it */
  uint64_t hold; /* the number of the hold, for a StopAndHold */
} corbot_counted_stop;

typedef struct corbot_caller {
  /* Returns a corbot_presence. A wait for a motion calls it a few times a second; if the caller has
   * disconnected, the wait ends with CORBOT_NOT_READY, and the motion continues. Every other waiting call
   * except a stop calls it every few milliseconds. Such a call then starts no motion (CORBOT_QUEUE_FULL if
   * crowded) and gives no control; other changes that it requested go on (CORBOT_NOT_READY). NULL: the caller
   * is always present. */
  int (*present)(void* context);
  void* context;
  int32_t places; /* slots for long calls of the caller's host */
  /* Key in the called reference, see corbot_read_key; NULL or "": the public reference. */
  const char* key;
  /* Address of the caller's connection, "127.0.0.1:51234", "local uid 1000"; NULL: not known. */
  const char* from;
  /* Result of corbot_robot_stops before the request was read; 0: the function reads the number when called.
   */
  uint64_t stops;
  /* A Stop or StopAndHold that was counted on arrival; the function does not count it again. */
  corbot_counted_stop counted;
  /* If not NULL, a function that starts a motion only plans it and fills this in. The function then needs no
   * control, waits for nothing, and leaves *ticket alone. */
  corbot_plan* plan;
} corbot_caller;

/* A key and its final zero, see corbot_robot_acquire. */
enum { CORBOT_KEY = 33 };
typedef struct corbot_holder {
  char who[65];  /* "": no client has control */
  double left_s; /* time left of the lease */
} corbot_holder;

/* The arm at the end of one cycle of the real-time task. Ages count from that cycle. */
typedef struct corbot_arm_state {
  uint64_t cycle;
  double time_s; /* when the cycle was due, since the Unix epoch */
  double age_s;  /* from then to now */
  corbot_state status;
  int32_t paused;
  int32_t held;
  double override_percent;
  double commanded[CORBOT_MAX_JOINTS]; /* set-points, degrees; m where the joint slides */
  double speed[CORBOT_MAX_JOINTS];     /* speed of the set-points, degrees/s; m/s where the joint slides */
  int32_t measured;                    /* the device measures the joints */
  double measured_joints[CORBOT_MAX_JOINTS]; /* like commanded */
  /* pose at the measured joints, else at the set-points */
  corbot_tool_pose tool;
  corbot_tool_pose tool_commanded;
  corbot_motion_info motion; /* the one under way; id 0: none */
  uint32_t queued;           /* accepted and not begun */
  corbot_gripper_info gripper;
  corbot_device_info device;
  corbot_holder holder;
} corbot_arm_state;

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_ROBOT_TYPES_H */
