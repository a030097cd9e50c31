/* SPDX-License-Identifier: Apache-2.0
 *
 * The robot without an ORB, in C: what every adapter (omniORB, ORBit2) calls. Units are the CORBA
 * interface's: metres, degrees, seconds, percent. Every function is thread-safe; none is real-time safe. No
 * exception crosses this header.
 *
 * Functions that can fail return CORBOT_OK or the kind of failure and fill *error. Nothing has moved then. */
#ifndef CORBOT_ROBOT_H
#define CORBOT_ROBOT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { CORBOT_MAX_JOINTS = 6, CORBOT_TEXT = 192, CORBOT_MAX_ALARMS = 64, CORBOT_LATENCY_BUCKETS = 64 };

/* Kinds of failure; each but the last two is an exception of robot.idl. */
typedef enum corbot_status {
  CORBOT_OK = 0,
  CORBOT_BAD_PARAMETER,  /* parameter, value, text */
  CORBOT_UNREACHABLE,    /* target_m, text */
  CORBOT_LIMIT_EXCEEDED, /* parameter = quantity, joint (-1: none), value, lower, upper, text */
  CORBOT_NOT_READY,      /* text */
  CORBOT_STOPPED,        /* text */
  CORBOT_QUEUE_FULL,     /* capacity, text */
  CORBOT_NO_DATA,        /* no real-time task has ever been seen; text */
  CORBOT_INTERNAL        /* text */
} corbot_status;

/* Strings are ASCII and terminated, never NULL. */
typedef struct corbot_error {
  corbot_status status;
  char parameter[48];
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

/* Order of robot.idl's enumerations. */
typedef enum corbot_gripper { CORBOT_GRIPPER_OPEN, CORBOT_GRIPPER_CLOSE } corbot_gripper;
typedef enum corbot_state { CORBOT_STATE_ERROR, CORBOT_STATE_WAITING, CORBOT_STATE_STANDBY } corbot_state;

/* What does not change while the servant runs. */
typedef struct corbot_description {
  char name[64];
  int32_t kind; /* order of RobotKind */
  int32_t dof;
  double lower_deg[CORBOT_MAX_JOINTS];
  double upper_deg[CORBOT_MAX_JOINTS];
  double reach_m;
  char endpoint_host[256]; /* where the profile says that the robot is served */
  int32_t endpoint_port;
  char version[32];     /* of corbot */
  char fingerprint[20]; /* of the arm's model, 16 hexadecimal digits */
  double started_s;     /* when the robot was opened, since the Unix epoch */
} corbot_description;

typedef struct corbot_pose {
  double x_m, y_m, z_m;
  double a_deg, b_deg, c_deg; /* Z-Y-X of the gripper's frame, b positive upward */
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

/* The servos' controller. Ages in seconds, 0 where there is nothing. */
typedef struct corbot_device_info {
  char backend[32]; /* `kind` of the profile */
  corbot_device_health health;
  uint32_t cause; /* why it is degraded or lost, 0: it is not */
  char cause_text[CORBOT_TEXT];
  uint64_t frames;             /* that it has taken */
  double age_s, age_max_s;     /* of the newest frame when it had taken it; the longest since it was opened */
  int32_t measured;            /* it measures positions */
  double measured_age_s;       /* of the last of them, now */
  int32_t position_unverified; /* the first motion is slow */
  int32_t emergency_stop;      /* seen now */
} corbot_device_info;

/* Reads the profile, attaches as the servant to the segment of `name` (NULL: the profile's own name) and
 * goes on trying in the background while no real-time task is there. NULL and *error on a bad profile or when
 * another servant is attached. */
corbot_robot* corbot_robot_open(const char* profile_path, const char* name, corbot_error* error);
/* From now on the last position is saved on disk for the next power-up, in `directory` (NULL:
 * CORBOT_STATE_DIR, or below XDG_STATE_HOME or HOME). `warn` (may be NULL) is called, from another thread,
 * when that fails. */
void corbot_robot_save_position(corbot_robot* robot, const char* directory, void (*warn)(const char* text));
/* Wakes every waiting call (CORBOT_NOT_READY) and detaches. What was accepted is carried out for as long as
 * the profile's orphan_s, unless another servant is attached by then. */
void corbot_robot_close(corbot_robot* robot);
/* Calls are served from now on. `answers` is called again and again until corbot_robot_interrupt, from a
 * thread of its own: 1 when a call from outside has got through, which proves that the servant responds, 0
 * when not. It must come back within a second or so. Where it fails for longer, the real-time task stops
 * what moves after the profile's orphan_s. The supervisor of this process is told by sd_notify(3): ready
 * now, and well as long as this succeeds. Once in a robot's life. */
void corbot_robot_serve(corbot_robot* robot, int (*answers)(void* context), void* context);
/* Every call that waits for a motion, now or later, returns CORBOT_NOT_READY: the process is about to end. */
void corbot_robot_interrupt(corbot_robot* robot);

void corbot_robot_describe(const corbot_robot* robot, corbot_description* out);

/* Reads; never wait for a motion. */
corbot_status corbot_robot_joints(const corbot_robot* robot, double out_deg[CORBOT_MAX_JOINTS],
                                  corbot_error* error);
corbot_status corbot_robot_pose(const corbot_robot* robot, corbot_pose* out, corbot_error* error);
corbot_gripper corbot_robot_gripper(const corbot_robot* robot);
corbot_state corbot_robot_state(const corbot_robot* robot);
double corbot_robot_override(const corbot_robot* robot);   /* percent */
int32_t corbot_robot_paused(const corbot_robot* robot);    /* a Pause is in force */
double corbot_robot_tool_pitch(const corbot_robot* robot); /* degrees */
size_t corbot_robot_alarms(const corbot_robot* robot, corbot_alarm out[CORBOT_MAX_ALARMS]);
corbot_status corbot_robot_loop_info(const corbot_robot* robot, corbot_loop_info* out, corbot_error* error);
corbot_status corbot_robot_device_info(const corbot_robot* robot, corbot_device_info* out,
                                       corbot_error* error);

/* Start a motion: plan all of it, hand it over, return its ticket. */
corbot_status corbot_robot_move(corbot_robot* robot, const double p_m[3], double d_m, double t_s,
                                corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_move_s(corbot_robot* robot, const double p_m[3], double d_m, double t_s,
                                  corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_move_c(corbot_robot* robot, const double p1_m[3], const double p2_m[3],
                                  const double p3_m[3], corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_move_joints(corbot_robot* robot, const double* target_deg, size_t count,
                                       double t_s, corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_drive(corbot_robot* robot, int32_t joint, double increment_deg, double speed_deg_s,
                                 corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_ready(corbot_robot* robot, corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_delay(corbot_robot* robot, double t_s, corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_open_gripper(corbot_robot* robot, corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_close_gripper(corbot_robot* robot, corbot_ticket* ticket, corbot_error* error);

/* The client that waits. `present` is asked a few times a second whether the caller is still there; 0 ends the wait with
 * CORBOT_NOT_READY, and the motion goes on. NULL: it is always there. */
typedef struct corbot_caller {
  int (*present)(void* context);
  void* context;
} corbot_caller;

/* Waits until the motion has ended (or for timeout_s; negative: for ever) and returns its state. CORBOT_OK
 * also when the time ran out or the motion failed: read info->state. CORBOT_BAD_PARAMETER: no such ticket. */
corbot_status corbot_robot_wait(corbot_robot* robot, corbot_ticket ticket, double timeout_s,
                                const corbot_caller* caller, corbot_motion_info* info, corbot_error* error);
/* Waits for ever and turns the end of the motion into a status: CORBOT_OK, _STOPPED, or _NOT_READY with the
 * reason. */
corbot_status corbot_robot_finish(corbot_robot* robot, corbot_ticket ticket, const corbot_caller* caller,
                                  corbot_error* error);

/* Pre-empt; never queued, never behind a plan that is being made. Stop returns at rest. */
corbot_status corbot_robot_stop(corbot_robot* robot, corbot_error* error);
/* Takes back one motion and what is queued behind it; what is before it goes on. Returns when they have
 * ended. CORBOT_OK and no effect when it has ended; CORBOT_BAD_PARAMETER: no such ticket. */
corbot_status corbot_robot_cancel(corbot_robot* robot, corbot_ticket ticket, corbot_error* error);
/* Until corbot_robot_resume; a Stop does not end it. */
corbot_status corbot_robot_pause(corbot_robot* robot, corbot_error* error);
corbot_status corbot_robot_resume(corbot_robot* robot, corbot_error* error);
corbot_status corbot_robot_set_override(corbot_robot* robot, double percent, corbot_error* error);
corbot_status corbot_robot_clear(corbot_robot* robot, corbot_error* error);

/* Settings for the motions planned from now on. */
corbot_status corbot_robot_speed(corbot_robot* robot, double percent, corbot_error* error);
corbot_status corbot_robot_art_speed(corbot_robot* robot, int32_t joint, double percent, corbot_error* error);
corbot_status corbot_robot_all_speed(corbot_robot* robot, double percent, corbot_error* error);
corbot_status corbot_robot_set_tool_pitch(corbot_robot* robot, double degrees, corbot_error* error);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_ROBOT_H */
