/* SPDX-License-Identifier: Apache-2.0
 *
 * A client in plain C, on ORBit2: describes the arm, moves it, and shows a refused motion.
 *
 *   hello_arm corbaloc::127.0.0.1:12810/lynx5
 *   hello_arm IOR:...        the reference that corbot-servant-orbit2 logs: to read a corbaloc, ORBit2 needs
 *                            16 GiB of memory
 *
 * It works with both servants. Build it by hand if ORBit2 is installed:
 *
 *   orbit-idl-2 arm.idl
 *   cc -o hello_arm hello_arm.c arm-common.c arm-stubs.c $(pkg-config --cflags --libs ORBit-2.0) */
#include <arm.h>
#include <orbit/orbit.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>

static volatile sig_atomic_t interrupted = 0;

static void note_interrupt(int signal_number) {
  (void)signal_number;
  interrupted = 1;
}

/* Every call of the C mapping fills an environment; the caller frees the exception in it. */
static int raised(CORBA_Environment* ev, const char* doing) {
  if (ev->_major == CORBA_NO_EXCEPTION) return 0;
  const char* id = CORBA_exception_id(ev);
  if (g_strcmp0(id, ex_Corbot_Unreachable) == 0) {
    const Corbot_Unreachable* why = CORBA_exception_value(ev);
    (void)printf("%s: refused, (%g, %g, %g) m is out of reach: %s\n", doing, why->target.x, why->target.y,
                 why->target.z, why->reason);
  } else if (g_strcmp0(id, ex_Corbot_NotReady) == 0) {
    const Corbot_NotReady* why = CORBA_exception_value(ev);
    (void)printf("%s: the robot is not ready: %s\n", doing, why->reason);
  } else if (g_strcmp0(id, ex_Corbot_LimitExceeded) == 0) {
    const Corbot_LimitExceeded* why = CORBA_exception_value(ev);
    (void)printf("%s: refused, %s of joint %d: %.4g is not within %.4g to %.4g\n", doing, why->quantity,
                 (int)why->articulation, why->value, why->lower, why->upper);
  } else if (g_strcmp0(id, ex_Corbot_BadParameter) == 0) {
    const Corbot_BadParameter* why = CORBA_exception_value(ev);
    (void)printf("%s: refused, %s = %g: %s\n", doing, why->parameter, why->value, why->reason);
  } else if (g_strcmp0(id, ex_Corbot_QueueFull) == 0) {
    const Corbot_QueueFull* why = CORBA_exception_value(ev);
    (void)printf("%s: refused, %d motions or calls wait already: try again when one has ended\n", doing,
                 (int)why->capacity);
  } else {
    (void)printf("%s: %s\n", doing, id);
  }
  CORBA_exception_free(ev);
  return 1;
}

static void print_joints(Corbot_Arm arm, CORBA_Environment* ev) {
  Corbot_JointCoord* joints = Corbot_Robot__get_ArtiCoord(arm, ev);
  if (raised(ev, "reading the joints")) return;
  (void)printf("joints");
  for (CORBA_unsigned_long i = 0; i < joints->_length; ++i) (void)printf(" %.2f", joints->_buffer[i]);
  (void)printf(" degrees\n");
  CORBA_free(joints); /* the caller frees what a call returns by pointer */
}

/* Waits in slices. Stops the arm at Ctrl-C, as the end of this program would not. Returns 1 at the target. */
static int is_done(Corbot_Arm arm, Corbot_Ticket motion, CORBA_Environment* ev) {
  for (;;) {
    Corbot_MotionInfo* info = Corbot_Arm_Wait(arm, motion, 0.1, ev);
    if (raised(ev, "Wait")) return 0;
    const Corbot_MotionState state = info->state;
    if (info->reason[0] != '\0') (void)printf("%s\n", info->reason);
    CORBA_free(info);
    if (state != Corbot_MotionQueued && state != Corbot_MotionRunning) return state == Corbot_MotionDone;
    if (!interrupted) continue;
    Corbot_Arm_Stop(arm, ev);
    if (raised(ev, "Stop")) return 0;
  }
}

static int use(Corbot_Arm arm, CORBA_Environment* ev) {
  const CORBA_long dof = Corbot_Robot__get_DoF(arm, ev);
  if (raised(ev, "asking")) return EXIT_FAILURE;
  const CORBA_double reach = Corbot_Robot__get_Reach(arm, ev);
  (void)printf("an arm of %d joints that reaches %.3f m\n", dof, reach);
  print_joints(arm, ev);

  /* Free motion to 30 mm above a point, as fast as the limits allow. */
  Corbot_Ticket motion = Corbot_Arm_StartMove(arm, 0.20, 0.05, 0.05, 0.03, 0.0, ev);
  if (raised(ev, "Move") || !is_done(arm, motion, ev)) return EXIT_FAILURE;
  /* Down in a straight line, in one second. */
  motion = Corbot_Arm_StartMoveS(arm, 0.20, 0.05, 0.05, 0.0, 1.0, ev);
  if (raised(ev, "MoveS") || !is_done(arm, motion, ev)) return EXIT_FAILURE;
  Corbot_Robot_Close(arm, ev);
  if (raised(ev, "Close")) return EXIT_FAILURE;
  print_joints(arm, ev);

  /* The robot refuses a point out of reach before anything moves. */
  Corbot_Robot_Move(arm, 0.90, 0.0, 0.10, 0.0, 0.0, ev);
  if (!raised(ev, "Move to (0.9, 0, 0.1)")) return EXIT_FAILURE;

  motion = Corbot_Arm_StartReady(arm, ev);
  if (raised(ev, "Ready") || !is_done(arm, motion, ev)) return EXIT_FAILURE;
  print_joints(arm, ev);
  return EXIT_SUCCESS;
}

int main(int argc, char** argv) {
  if (argc != 2) {
    (void)fprintf(stderr, "usage: %s corbaloc::HOST:PORT/NAME\n", argv[0]);
    return 2;
  }
  /* Selects IPv4, which ORBit2 does not use by default. Switches the time-out off: the default of 60 s would
   * end a motion's call that takes longer. */
  char* options[] = {argv[0], (char*)"--ORBIIOPIPv4=1", (char*)"--GIOPTimeoutMSEC=0", NULL};
  int count = 3;
  (void)signal(SIGINT, note_interrupt);
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  CORBA_ORB orb = CORBA_ORB_init(&count, options, (char*)"orbit-local-orb", &ev);
  if (raised(&ev, "starting the ORB")) return EXIT_FAILURE;
  int result = EXIT_FAILURE;
  Corbot_Arm arm = CORBA_ORB_string_to_object(orb, argv[1], &ev);
  if (!raised(&ev, "reading the reference")) {
    result = use(arm, &ev);
    CORBA_Object_release(arm, &ev);
  }
  CORBA_ORB_destroy(orb, &ev);
  CORBA_Object_release((CORBA_Object)orb, &ev);
  CORBA_exception_free(&ev);
  return result;
}
