/* SPDX-License-Identifier: Apache-2.0
 *
 * The robot without an ORB, in C: what every adapter (omniORB, ORBit2) calls. Units are the CORBA
 * interface's: metres, degrees, seconds, percent; of a joint that slides metres and m/s where others have degrees and
 * degrees/s. Every function is thread-safe; none is real-time safe. No exception crosses this header.
 *
 * Functions that can fail return CORBOT_OK or the kind of failure and fill *error. Nothing has moved then. */
#ifndef CORBOT_ROBOT_H
#define CORBOT_ROBOT_H

#include <stddef.h>
#include <stdint.h>

#include "robot/corbot_robot_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reads the profile, attaches as the servant to the segment of `name` (NULL: the profile's own name) and
 * goes on trying in the background while no real-time task is there. NULL and *error on a bad profile or when
 * another servant is attached. */
corbot_robot* corbot_robot_open(const char* profile_path, const char* name, corbot_error* error);
/* From now on the last position is saved on disk for the next power-up, and every call with a caller but the waits is
 * recorded in the audit log, both in `directory` (NULL: CORBOT_STATE_DIR, or below XDG_STATE_HOME or HOME). `warn`
 * (may be NULL) is called, from another thread, when that fails; no call does for it. */
void corbot_robot_keep_state(corbot_robot* robot, const char* directory, void (*warn)(const char* text));
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
/* The profile's arm as a URDF, which lives as long as the robot. */
const char* corbot_robot_urdf(const corbot_robot* robot);

/* Reads; never wait for a motion. */
corbot_status corbot_robot_joints(const corbot_robot* robot, double out[CORBOT_MAX_JOINTS],
                                  corbot_error* error);
corbot_status corbot_robot_pose(const corbot_robot* robot, corbot_pose* out, corbot_error* error);
/* All that can be read of one cycle. CORBOT_NO_DATA: no real-time task has ever been seen. */
corbot_status corbot_robot_arm_state(const corbot_robot* robot, corbot_arm_state* out, corbot_error* error);
corbot_gripper corbot_robot_gripper(const corbot_robot* robot);
corbot_state corbot_robot_state(const corbot_robot* robot);
double corbot_robot_override(const corbot_robot* robot);   /* percent */
int32_t corbot_robot_paused(const corbot_robot* robot);    /* a Pause is in force */
double corbot_robot_tool_pitch(const corbot_robot* robot); /* degrees */
size_t corbot_robot_alarms(const corbot_robot* robot, corbot_alarm out[CORBOT_MAX_ALARMS]);
corbot_status corbot_robot_loop_info(const corbot_robot* robot, corbot_loop_info* out, corbot_error* error);
/* Since the newest cycle of the real-time task, of which all of these are. */
corbot_status corbot_robot_cycle_age(const corbot_robot* robot, double* out_s, corbot_error* error);
corbot_status corbot_robot_device_info(const corbot_robot* robot, corbot_device_info* out,
                                       corbot_error* error);

/* How many stops have been counted so far, and how many of them by other processes; 0 where no real-time
 * task has been seen. A request has this number from its arrival on, see corbot_caller. */
void corbot_robot_stops(const corbot_robot* robot, uint64_t* all, uint64_t* by_others);

/* Exclusive control: whoever holds it works through a reference with a key that nobody can guess. While it is held,
 * motions, settings, Cancel, Pause, Resume and Override without that key are refused: CORBOT_NOT_READY, the text names
 * the holder and the time left. A key that was never given is refused as one whose control has ended. Reads, waits,
 * Stop, StopAndHold and Clear are free for everyone, through every key. */

/* Takes control for `lease_s`, and gives the key, 32 hexadecimal digits. The lease begins anew with each call under the
 * key and with corbot_robot_renew, and does not run out while such a call is under way. When it has run out, and with
 * corbot_robot_release, the arm is stopped on its path. CORBOT_BAD_PARAMETER: a name or a lease that is not allowed;
 * CORBOT_NOT_READY: another has control, motions of others are pending, or the caller is no longer there. */
corbot_status corbot_robot_acquire(corbot_robot* robot, const corbot_caller* caller, const char* who,
                                   double lease_s, char key[CORBOT_KEY], corbot_error* error);
/* For corbot_caller, from the octets in the reference that was called: what cannot be a key (too long, too short, or with
 * a zero in it, where a C string would end) becomes "-", which is none either. */
void corbot_read_key(const void* octets, size_t length, char key[CORBOT_KEY]);
/* CORBOT_NOT_READY: the caller's key has no control, or not any more. */
corbot_status corbot_robot_renew(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
/* Returns at rest. CORBOT_NOT_READY as above; and where it is not known that the arm has stopped: control has ended then,
 * too. */
corbot_status corbot_robot_release(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
/* The same for whoever has control, for a caller with no key: the robot's own user, where the key is lost.
 * CORBOT_NOT_READY: nobody has control, or just gets it, or gives it back; and as above. */
corbot_status corbot_robot_end_control(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
/* By SIGUSR1, which the kernel delivers from this process's user and from root only (`corbot release --force`). The first
 * before the program starts a thread or opens a robot, the second once calls are served, until corbot_robot_close. */
void corbot_block_release_signal(void);
void corbot_robot_heed_release_signal(corbot_robot* robot);
void corbot_robot_holder(const corbot_robot* robot, corbot_holder* out);

/* Start a motion: plan all of it, hand it over, return its ticket. CORBOT_STOPPED where a Stop was counted
 * since the request arrived. */
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

/* 0 (closed) to 100 (open). Ends, where the device measures the opening, when the fingers have got as far as they get. */
corbot_status corbot_robot_set_gripper(corbot_robot* robot, const corbot_caller* caller, double percent,
                                       corbot_ticket* ticket, corbot_error* error);

/* To a pose, freely and along a line, and by an offset from where the tool is when the motion begins. Quaternions are of unit
 * length within 1e-6, w of any sign. `frame`: a corbot_offset_frame. */
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

/* Waits until the motion has ended (or for timeout_s; negative: for ever) and returns its state. CORBOT_OK
 * also when the time ran out or the motion failed: read info->state. CORBOT_BAD_PARAMETER: no such ticket;
 * CORBOT_NO_DATA: none yet, as no task has been connected that knows those of the servant before. */
corbot_status corbot_robot_wait(corbot_robot* robot, corbot_ticket ticket, double timeout_s,
                                const corbot_caller* caller, corbot_motion_info* info, corbot_error* error);
/* Waits for ever and turns the end of the motion into a status: CORBOT_OK, _STOPPED, or _NOT_READY with the
 * reason. */
corbot_status corbot_robot_finish(corbot_robot* robot, corbot_ticket ticket, const corbot_caller* caller,
                                  corbot_error* error);

/* This counts a Stop, or with `hold` not 0 a StopAndHold, before all that its call takes. It takes no lock, no memory and no
 * system call. The call then gets the result in corbot_caller. Where no real-time task is connected nothing is counted: the
 * call does that, or refuses. */
corbot_counted_stop corbot_robot_count_stop(corbot_robot* robot, int32_t hold);
/* Pre-empt; never queued, never behind a plan that is being made. Stop returns at rest. */
corbot_status corbot_robot_stop(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
/* For many at once, in two halves: the first counts a stop, with `hold` not 0 that of a StopAndHold, and does not wait;
 * the second returns at rest, when all of them that were requested by the first are carried out. */
void corbot_robot_request_stop(corbot_robot* robot, const corbot_caller* caller, int32_t hold);
corbot_status corbot_robot_await_stops(corbot_robot* robot, int32_t hold, corbot_error* error);
/* Takes back one motion and what is queued behind it; what is before it goes on. Returns when they have
 * ended. CORBOT_OK and no effect when it has ended; CORBOT_BAD_PARAMETER: no such ticket;
 * CORBOT_NOT_READY: nor is there a task. */
corbot_status corbot_robot_cancel(corbot_robot* robot, const corbot_caller* caller, corbot_ticket ticket,
                                  corbot_error* error);
/* As Stop, and from then on nothing moves, whoever calls, until corbot_robot_clear: CORBOT_STATE_ERROR, with an alarm
 * of its own. Holds across restarts of this process and of the real-time task. */
corbot_status corbot_robot_stop_and_hold(corbot_robot* robot, const corbot_caller* caller,
                                         corbot_error* error);
int32_t corbot_robot_held(const corbot_robot* robot); /* a StopAndHold is in force */
/* Until corbot_robot_resume; a Stop does not end it. */
corbot_status corbot_robot_pause(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
corbot_status corbot_robot_resume(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);
corbot_status corbot_robot_set_override(corbot_robot* robot, const corbot_caller* caller, double percent,
                                        corbot_error* error);
corbot_status corbot_robot_clear(corbot_robot* robot, const corbot_caller* caller, corbot_error* error);

/* Settings for the motions planned from now on. CORBOT_NOT_READY: another has control. */
corbot_status corbot_robot_speed(corbot_robot* robot, const corbot_caller* caller, double percent,
                                 corbot_error* error);
corbot_status corbot_robot_art_speed(corbot_robot* robot, const corbot_caller* caller, int32_t joint,
                                     double percent, corbot_error* error);
corbot_status corbot_robot_all_speed(corbot_robot* robot, const corbot_caller* caller, double percent,
                                     corbot_error* error);
/* What these three have set, percent; of the joints as many as the arm has. */
void corbot_robot_speeds(const corbot_robot* robot, double* tool, double joints[CORBOT_MAX_JOINTS]);
corbot_status corbot_robot_set_tool_pitch(corbot_robot* robot, const corbot_caller* caller, double degrees,
                                          corbot_error* error);
/* Unit quaternion w, x, y, z; CORBOT_BAD_PARAMETER also where the arm does not follow every orientation. */
corbot_status corbot_robot_set_tool_orientation(corbot_robot* robot, const corbot_caller* caller,
                                                const double orientation[4], corbot_error* error);
/* Takes back what the two above have set. */
corbot_status corbot_robot_reset_tool_orientation(corbot_robot* robot, const corbot_caller* caller,
                                                  corbot_error* error);
/* 1 and the one that is set, w not negative; 0 and no rotation where none is. */
int32_t corbot_robot_tool_orientation(const corbot_robot* robot, double out[4]);

/* Tool frame (flange to tool centre point) and base frame (where the arm stands in the frame of all positions), in place of the
 * profile's, for motions planned from now on and for what is read. CORBOT_BAD_PARAMETER: not finite, no unit quaternion
 * within 1e-6, too far, or a tool that this arm cannot take; CORBOT_NOT_READY: another has control. */
corbot_status corbot_robot_set_tool_frame(corbot_robot* robot, const corbot_caller* caller,
                                          const corbot_tool_pose* flange_T_tool, corbot_error* error);
corbot_status corbot_robot_set_base_frame(corbot_robot* robot, const corbot_caller* caller,
                                          const corbot_tool_pose* world_T_base, corbot_error* error);
/* The profile's again, both. */
corbot_status corbot_robot_reset_frames(corbot_robot* robot, const corbot_caller* caller,
                                        corbot_error* error);
/* Those in force. */
void corbot_robot_frames(const corbot_robot* robot, corbot_tool_pose* flange_T_tool,
                         corbot_tool_pose* world_T_base);

/* All solutions at a pose in the frames in force, in the order of their numbers; their number in *count. Turns are counted from
 * where the arm stands. CORBOT_BAD_PARAMETER, CORBOT_UNREACHABLE: there is none. */
corbot_status corbot_robot_solutions(const corbot_robot* robot, const corbot_tool_pose* target,
                                     corbot_pose_solution out[CORBOT_MAX_SOLUTIONS], size_t* count,
                                     corbot_error* error);
/* The number of the one on which the set-points lie; -1: the arm's family has no closed form. */
corbot_status corbot_robot_solution(const corbot_robot* robot, int32_t* number, corbot_error* error);

/* Soft limits: ranges within the profile's that every motion keeps which is planned from now on; saved in the state
 * directory. `count`: of the ranges. CORBOT_BAD_PARAMETER: not one for each joint, not finite, or the lower above the upper;
 * CORBOT_LIMIT_EXCEEDED: beyond the profile's, or the arm stands outside; CORBOT_NOT_READY: motions are under way, they
 * cannot be saved, or another has control. */
corbot_status corbot_robot_set_soft_limits(corbot_robot* robot, const corbot_caller* caller,
                                           const corbot_joint_ranges* limits, size_t count,
                                           corbot_error* error);
/* The profile's ranges again. */
corbot_status corbot_robot_reset_soft_limits(corbot_robot* robot, const corbot_caller* caller,
                                             corbot_error* error);
/* Those in force, and 1; or 0: they are not known, and no joint moves until they are set or reset. */
int32_t corbot_robot_soft_limits(const corbot_robot* robot, corbot_joint_ranges* out);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_ROBOT_H */
