/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/arm_servant.h"

#include <string.h>

#include "orb/orbit2/arm_bounded.h"
#include "orb/orbit2/arm_changes.h"
#include "orb/orbit2/arm_frames.h"
#include "orb/orbit2/arm_motions.h"
#include "orb/orbit2/arm_plans.h"
#include "orb/orbit2/arm_poses.h"
#include "orb/orbit2/arm_reads.h"
#include "orb/orbit2/arm_workspace.h"

static PortableServer_ServantBase__epv base_epv;
static POA_Corbot_Robot__epv robot_epv;
static POA_Corbot_Arm__epv arm_epv;
static POA_Corbot_Arm__vepv vepv = {&base_epv, &robot_epv, &arm_epv};

void arm_servant_init(ArmServant* servant, corbot_robot* robot, const ControlReferences* references,
                      int target, CORBA_Environment* ev) {
  arm_set_motions(&robot_epv, &arm_epv);
  arm_set_poses(&arm_epv);
  arm_set_changes(&robot_epv, &arm_epv);
  arm_set_reads(&robot_epv, &arm_epv);
  arm_set_frames(&arm_epv);
  arm_set_plans(&arm_epv);
  arm_set_workspace(&arm_epv);
  arm_bound(&arm_epv);
  memset(servant, 0, sizeof(*servant));
  servant->base.vepv = &vepv;
  servant->robot = robot;
  servant->references = references;
  corbot_robot_describe(robot, &servant->description);
  servant->target = target;
  POA_Corbot_Arm__init(&servant->base, ev);
}

void arm_servant_fini(ArmServant* servant, CORBA_Environment* ev) {
  POA_Corbot_Arm__fini(&servant->base, ev);
}
