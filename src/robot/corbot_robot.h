/* SPDX-License-Identifier: Apache-2.0
 *
 * The robot without an ORB, in C, for all adapters (omniORB, ORBit2). The units are those of the CORBA
 * interface: metres, degrees, seconds, percent. Values of a sliding joint are in metres and m/s instead of
 * degrees and degrees/s. Every function is thread-safe; none is real-time safe. No exception crosses this
 * header.
 *
 * Functions that can fail return CORBOT_OK or the kind of failure and fill *error. After a failure nothing
 * has moved. */
#ifndef CORBOT_ROBOT_H
#define CORBOT_ROBOT_H

#include <stddef.h>
#include <stdint.h>

#include "robot/corbot_robot_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reads the profile and attaches as the servant to the segment of `name` (NULL: the profile's own name).
 * Retries in the background while no real-time task runs. Returns NULL and fills *error if the profile is
 * invalid or another servant is attached. */
corbot_robot* corbot_robot_open(const char* profile_path, const char* name, corbot_error* error);
/* Saves the last position on disk for the next power-up from now on. Records every call that has a caller,
 * except the waits, in the audit log. Both are in `directory` (NULL: CORBOT_STATE_DIR, or below
 * XDG_STATE_HOME or HOME). If that fails, no call fails; another thread calls `warn` (may be NULL). */
void corbot_robot_keep_state(corbot_robot* robot, const char* directory, void (*warn)(const char* text));
/* Wakes every waiting call (CORBOT_NOT_READY) and detaches. The task continues accepted motions for the
 * profile's orphan_s, or longer if another servant attaches by then. */
void corbot_robot_close(corbot_robot* robot);
/* Reports that calls are served from now on. A separate thread calls `answers` repeatedly until
 * corbot_robot_interrupt. `answers` returns 1 if a call from outside got through, which proves that the
 * servant responds, else 0. It must return within about a second. If it fails for longer, the real-time task
 * stops the arm after the profile's orphan_s. The supervisor of this process receives sd_notify(3): ready
 * now, and alive while `answers` succeeds. Call this function once in a robot's life. */
void corbot_robot_serve(corbot_robot* robot, int (*answers)(void* context), void* context);
/* Ends every wait for a motion, now and later, with CORBOT_NOT_READY: the process is about to end. */
void corbot_robot_interrupt(corbot_robot* robot);

void corbot_robot_describe(const corbot_robot* robot, corbot_description* out);
/* The profile's arm as a URDF; the text lives as long as the robot. */
const char* corbot_robot_urdf(const corbot_robot* robot);

/* Reads. They never wait for a motion. */
corbot_status corbot_robot_joints(const corbot_robot* robot, double out[CORBOT_MAX_JOINTS],
                                  corbot_error* error);
corbot_status corbot_robot_pose(const corbot_robot* robot, corbot_pose* out, corbot_error* error);
/* Reads all data of one cycle. CORBOT_NO_DATA: no real-time task has run yet. */
corbot_status corbot_robot_arm_state(const corbot_robot* robot, corbot_arm_state* out, corbot_error* error);
corbot_gripper corbot_robot_gripper(const corbot_robot* robot);
corbot_state corbot_robot_state(const corbot_robot* robot);
double corbot_robot_override(const corbot_robot* robot);   /* percent */
int32_t corbot_robot_paused(const corbot_robot* robot);    /* a Pause is in force */
double corbot_robot_tool_pitch(const corbot_robot* robot); /* degrees */
size_t corbot_robot_alarms(const corbot_robot* robot, corbot_alarm out[CORBOT_MAX_ALARMS]);
corbot_status corbot_robot_loop_info(const corbot_robot* robot, corbot_loop_info* out, corbot_error* error);
/* Time since the newest cycle of the real-time task. All of these reads refer to that cycle. */
corbot_status corbot_robot_cycle_age(const corbot_robot* robot, double* out_s, corbot_error* error);
corbot_status corbot_robot_device_info(const corbot_robot* robot, corbot_device_info* out,
                                       corbot_error* error);

/* Number of stops counted so far, and how many of them other processes counted; 0 before the first real-time
 * task. The adapter reads the number when a request arrives, see corbot_caller. */
void corbot_robot_stops(const corbot_robot* robot, uint64_t* all, uint64_t* by_others);

/* Exclusive control: the holder uses a reference with a key that cannot be guessed. While a client has
 * control, calls without its key fail with CORBOT_NOT_READY if they are motions, settings, Cancel, Pause,
 * Resume or Override. The text names the holder and the time left. A key that was never issued fails like one
 * whose control has ended. Every client may use reads, waits, Stop, StopAndHold and Clear, through every key.
 */

/* Takes control for `lease_s` and fills in the key, 32 hexadecimal digits. Each call with the key and
 * corbot_robot_renew begin the lease anew; the lease does not run during such a call. The arm stops on its
 * path when the lease has run out, and on corbot_robot_release. CORBOT_BAD_PARAMETER: the name or the lease
 * is not allowed. CORBOT_NOT_READY: another client has control, other clients' motions are pending, or the
 * caller has disconnected. */
corbot_status corbot_robot_acquire(corbot_robot* robot, const corbot_caller* caller, const char* who,
                                   double lease_s, char key[CORBOT_KEY], corbot_error* error);
/* Reads the key for corbot_caller from the octets in the called reference. Octets that cannot be a key become
 * "-", which is no valid key either. Examples: too long, too short, or with a zero, where a C string would
 * end. */
void corbot_read_key(const void* octets, size_t length, char key[CORBOT_KEY]);
/* Begins the lease anew. CORBOT_NOT_READY: the caller's key does not have control, or no longer. */
corbot_status corbot_robot_renew(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
/* Ends control; returns at rest. CORBOT_NOT_READY: as above, or the arm may not have stopped. In the second
 * case control has ended, too. */
corbot_status corbot_robot_release(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
/* Ends control of any holder, for a caller without a key: the robot's own user, when the key is lost.
 * CORBOT_NOT_READY: no client has control, a client is just acquiring or releasing it, and as above. */
corbot_status corbot_robot_end_control(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
/* Forced release by SIGUSR1, which the kernel delivers only from this process's user and from root (`corbot
 * release --force`). Call the first function before the program starts a thread or opens a robot. Call the
 * second when calls are served; it works until corbot_robot_close. */
void corbot_block_release_signal(void);
void corbot_robot_heed_release_signal(corbot_robot* robot);
void corbot_robot_holder(const corbot_robot* robot, corbot_holder* out);

/* Start a motion: plan all of it, hand it over, return its ticket. CORBOT_STOPPED: a Stop was counted after
 * the request arrived. */
corbot_status corbot_robot_move(corbot_robot* robot, const corbot_caller* caller, const double p_m[3],
                                double d_m, double t_s, corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_move_s(corbot_robot* robot, const corbot_caller* caller, const double p_m[3],
                                  double d_m, double t_s, corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_move_c(corbot_robot* robot, const corbot_caller* caller, const double p1_m[3],
                                  const double p2_m[3], const double p3_m[3], corbot_ticket* ticket,
                                  corbot_error* error);
corbot_status corbot_robot_move_joints(corbot_robot* robot, const corbot_caller* caller, const double* target,
                                       size_t count, double t_s, corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_drive(corbot_robot* robot, const corbot_caller* caller, int32_t joint,
                                 double increment, double speed, corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_ready(corbot_robot* robot, const corbot_caller* caller, corbot_ticket* ticket,
                                 corbot_error* error);
corbot_status corbot_robot_delay(corbot_robot* robot, const corbot_caller* caller, double t_s,
                                 corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_open_gripper(corbot_robot* robot, const corbot_caller* caller,
                                        corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_close_gripper(corbot_robot* robot, const corbot_caller* caller,
                                         corbot_ticket* ticket, corbot_error* error);

/* Moves the gripper to 0 (closed) to 100 (open). If the device measures the opening, the motion ends when the
 * fingers have stopped. */
corbot_status corbot_robot_set_gripper(corbot_robot* robot, const corbot_caller* caller, double percent,
                                       corbot_ticket* ticket, corbot_error* error);

/* Move to a pose, freely and along a line, and by an offset from the tool's pose at the beginning of the
 * motion. Quaternions have unit length within 1e-6 and w of any sign. `frame`: a corbot_offset_frame. */
corbot_status corbot_robot_move_pose(corbot_robot* robot, const corbot_caller* caller,
                                     const corbot_tool_pose* target, double t_s, corbot_ticket* ticket,
                                     corbot_error* error);
corbot_status corbot_robot_move_pose_s(corbot_robot* robot, const corbot_caller* caller,
                                       const corbot_tool_pose* target, double t_s, corbot_ticket* ticket,
                                       corbot_error* error);
corbot_status corbot_robot_move_relative(corbot_robot* robot, const corbot_caller* caller,
                                         const corbot_tool_pose* offset, int32_t frame, double t_s,
                                         corbot_ticket* ticket, corbot_error* error);
corbot_status corbot_robot_move_relative_s(corbot_robot* robot, const corbot_caller* caller,
                                           const corbot_tool_pose* offset, int32_t frame, double t_s,
                                           corbot_ticket* ticket, corbot_error* error);

/* Waits until the motion has ended, or for timeout_s (negative: without limit), and returns its state.
 * Returns CORBOT_OK also after a time-out or a failed motion: read info->state. CORBOT_BAD_PARAMETER: no such
 * ticket. CORBOT_NO_DATA: no such ticket yet, as no task has connected that knows the tickets of the previous
 * servant. */
corbot_status corbot_robot_wait(corbot_robot* robot, corbot_ticket ticket, double timeout_s,
                                const corbot_caller* caller, corbot_motion_info* info, corbot_error* error);
/* Waits without limit and turns the end of the motion into a status: CORBOT_OK, _STOPPED, or _NOT_READY with
 * the reason. */
corbot_status corbot_robot_finish(corbot_robot* robot, corbot_ticket ticket, const corbot_caller* caller,
                                  corbot_error* error);

/* Counts a Stop, or a StopAndHold if `hold` is not 0, before its call takes any lock. Takes no lock, no
 * memory and no system call. The caller passes the result on in corbot_caller. Counts nothing if no real-time
 * task is connected: the call then counts the stop, or refuses it. */
corbot_counted_stop corbot_robot_count_stop(corbot_robot* robot, int32_t hold);
/* Pre-empts. Never queued, and never waits for a plan in progress. Stop returns at rest. */
corbot_status corbot_robot_stop(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
/* Stop many robots at once, in two halves. The first counts a stop (`hold` not 0: of a StopAndHold) and does
 * not wait. The second returns at rest, when all stops that the first requested are carried out. */
void corbot_robot_request_stop(corbot_robot* robot, const corbot_caller* caller, int32_t hold);
corbot_status corbot_robot_await_stops(corbot_robot* robot, int32_t hold, corbot_error* error);
/* Cancels one motion and all motions queued behind it; earlier motions continue. Returns when the cancelled
 * motions have ended. CORBOT_OK without effect if the motion has already ended. CORBOT_BAD_PARAMETER: no such
 * ticket. CORBOT_NOT_READY: no such ticket, and no task is connected. */
corbot_status corbot_robot_cancel(corbot_robot* robot, const corbot_caller* caller, corbot_ticket ticket,
                                  corbot_error* error);
/* Stops like Stop. From then on no client can move the arm until corbot_robot_clear: the state is
 * CORBOT_STATE_ERROR, with an alarm of its own. The hold persists across restarts of this process and of the
 * real-time task. */
corbot_status corbot_robot_stop_and_hold(corbot_robot* robot, const corbot_caller* caller,
                                         corbot_error* error);
int32_t corbot_robot_held(const corbot_robot* robot); /* a StopAndHold is in force */
/* Pauses until corbot_robot_resume; a Stop does not end the pause. */
corbot_status corbot_robot_pause(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
corbot_status corbot_robot_resume(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
corbot_status corbot_robot_set_override(corbot_robot* robot, const corbot_caller* caller, double percent,
                                        corbot_error* error);
corbot_status corbot_robot_clear(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);

/* Settings for the motions planned from now on. CORBOT_NOT_READY: another client has control. */
corbot_status corbot_robot_speed(corbot_robot* robot, const corbot_caller* caller, double percent,
                                 corbot_error* error);
corbot_status corbot_robot_art_speed(corbot_robot* robot, const corbot_caller* caller, int32_t joint,
                                     double percent, corbot_error* error);
corbot_status corbot_robot_all_speed(corbot_robot* robot, const corbot_caller* caller, double percent,
                                     corbot_error* error);
/* The values that these three have set, in percent, with one element for each joint of the arm. */
void corbot_robot_speeds(const corbot_robot* robot, double* tool, double joints[CORBOT_MAX_JOINTS]);
corbot_status corbot_robot_set_tool_pitch(corbot_robot* robot, const corbot_caller* caller, double degrees,
                                          corbot_error* error);
/* Sets the unit quaternion w, x, y, z. CORBOT_BAD_PARAMETER also if the arm cannot follow every orientation.
 */
corbot_status corbot_robot_set_tool_orientation(corbot_robot* robot, const corbot_caller* caller,
                                                const double orientation[4], corbot_error* error);
/* Undoes the two settings above. */
corbot_status corbot_robot_reset_tool_orientation(corbot_robot* robot, const corbot_caller* caller,
                                                  corbot_error* error);
/* Returns 1 and the orientation that is set, w not negative. Returns 0 and no rotation if none is set. */
int32_t corbot_robot_tool_orientation(const corbot_robot* robot, double out[4]);

/* Set the tool frame (flange to tool centre point) and the base frame (the arm's base in the frame of all
 * positions) instead of the profile's. They apply to reads and to motions planned from now on.
 * CORBOT_BAD_PARAMETER: not finite, no unit quaternion within 1e-6, too far, or a tool that this arm cannot
 * take. CORBOT_NOT_READY: another client has control. */
corbot_status corbot_robot_set_tool_frame(corbot_robot* robot, const corbot_caller* caller,
                                          const corbot_tool_pose* flange_T_tool, corbot_error* error);
corbot_status corbot_robot_set_base_frame(corbot_robot* robot, const corbot_caller* caller,
                                          const corbot_tool_pose* world_T_base, corbot_error* error);
/* Restores both frames of the profile. */
corbot_status corbot_robot_reset_frames(corbot_robot* robot, const corbot_caller* caller,
                                        corbot_error* error);
/* The frames in force. */
void corbot_robot_frames(const corbot_robot* robot, corbot_tool_pose* flange_T_tool,
                         corbot_tool_pose* world_T_base);

/* All solutions at a pose in the frames in force, ordered by their numbers, and their count in *count. Turns
 * count from the present position of the arm. CORBOT_BAD_PARAMETER, CORBOT_UNREACHABLE: there is no solution.
 */
corbot_status corbot_robot_solutions(const corbot_robot* robot, const corbot_tool_pose* target,
                                     corbot_pose_solution out[CORBOT_MAX_SOLUTIONS], size_t* count,
                                     corbot_error* error);
/* The number of the solution on which the set-points lie; -1: the arm's family has no closed form. */
corbot_status corbot_robot_solution(const corbot_robot* robot, int32_t* number, corbot_error* error);

/* Sets the soft limits: ranges within the profile's that every motion planned from now on keeps. The state
 * directory stores them. `count`: number of ranges. CORBOT_BAD_PARAMETER: not one range for each joint, not
 * finite, or the lower bound above the upper. CORBOT_LIMIT_EXCEEDED: beyond the profile's ranges, or the arm
 * is outside. CORBOT_NOT_READY: motions are under way, the limits cannot be saved, or another client has
 * control. */
corbot_status corbot_robot_set_soft_limits(corbot_robot* robot, const corbot_caller* caller,
                                           const corbot_joint_ranges* limits, size_t count,
                                           corbot_error* error);
/* Restores the profile's ranges. */
corbot_status corbot_robot_reset_soft_limits(corbot_robot* robot, const corbot_caller* caller,
                                             corbot_error* error);
/* Returns 1 and the limits in force. Returns 0 if they are not known: no joint moves until they are set or
 * reset. */
int32_t corbot_robot_soft_limits(const corbot_robot* robot, corbot_joint_ranges* out);

/* Sets planes and boxes that every motion planned from now on keeps, beside the profile's. The state
 * directory stores them. CORBOT_BAD_PARAMETER: more than CORBOT_MAX_FURTHER_SHAPES, not finite, flat, a name
 * that is not allowed or taken, or no part of the arm. CORBOT_LIMIT_EXCEEDED: the arm stands beyond one.
 * CORBOT_NOT_READY: motions are under way, the shapes cannot be saved, or another client has control. The
 * call reads at most CORBOT_MAX_FURTHER_SHAPES of `shapes`. */
corbot_status corbot_robot_set_workspace(corbot_robot* robot, const corbot_caller* caller,
                                         const corbot_shape* shapes, size_t count, corbot_error* error);
/* Removes them. CORBOT_NOT_READY also while motions are under way. */
corbot_status corbot_robot_reset_workspace(corbot_robot* robot, const corbot_caller* caller,
                                           corbot_error* error);
/* The planes and boxes in force. */
void corbot_robot_workspace(const corbot_robot* robot, corbot_workspace* out);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_ROBOT_H */
