/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/arm_servant.h"

#include <string.h>

#include "orb/orbit2/arm_immediate.h"
#include "orb/orbit2/arm_motions.h"

static PortableServer_ServantBase__epv base_epv;
static POA_Corbot_Robot__epv robot_epv;
static POA_Corbot_Arm__epv arm_epv;
static POA_Corbot_Arm__vepv vepv = {&base_epv, &robot_epv, &arm_epv};

/* ORBit2 leaves this entry of the base table empty, and answers BAD_OPERATION then. */
static CORBA_boolean non_existent(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)servant;
  (void)ev;
  return CORBA_FALSE;
}

void arm_servant_init(ArmServant* servant, corbot_robot* robot, int target, CORBA_Environment* ev) {
  base_epv.non_existent = non_existent;
  arm_set_motions(&robot_epv, &arm_epv);
  arm_set_immediate(&robot_epv, &arm_epv);
  memset(servant, 0, sizeof(*servant));
  servant->base.vepv = &vepv;
  servant->robot = robot;
  corbot_robot_describe(robot, &servant->description);
  servant->target = target;
  POA_Corbot_Arm__init(&servant->base, ev);
}

void arm_servant_fini(ArmServant* servant, CORBA_Environment* ev) {
  POA_Corbot_Arm__fini(&servant->base, ev);
}
