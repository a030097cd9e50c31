/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/arm_workspace.h"

#include <string.h>

#include "orb/orbit2/arm_instance.h"
#include "orb/orbit2/calls.h"
#include "orb/orbit2/raise.h"

static Corbot_Point point_of(const double at_m[3]) {
  const Corbot_Point point = {at_m[0], at_m[1], at_m[2]};
  return point;
}

static void take_point(const Corbot_Point* point, double at_m[3]) {
  at_m[0] = point->x;
  at_m[1] = point->y;
  at_m[2] = point->z;
}

static void convert_shapes(const corbot_shape* from, size_t count, Corbot_WorkspaceShapes* to) {
  to->_buffer = Corbot_WorkspaceShapes_allocbuf((CORBA_unsigned_long)count);
  to->_length = to->_maximum = (CORBA_unsigned_long)count;
  to->_release = CORBA_TRUE;
  for (size_t i = 0; i < count; ++i) {
    to->_buffer[i].name = CORBA_string_dup(from[i].name);
    to->_buffer[i].kind = (Corbot_ShapeKind)from[i].kind;
    to->_buffer[i].parts = from[i].parts;
    to->_buffer[i].normal = point_of(from[i].normal);
    to->_buffer[i].offset = from[i].offset_m;
    to->_buffer[i].least = point_of(from[i].from_m);
    to->_buffer[i].greatest = point_of(from[i].to_m);
  }
}

/* A name that is too long fills its place and is refused by its length. */
static void take_shape(const Corbot_WorkspaceShape* from, corbot_shape* to) {
  memset(to, 0, sizeof(*to));
  strncpy(to->name, from->name, sizeof(to->name) - 1);
  to->kind = (corbot_shape_kind)from->kind;
  to->parts = from->parts;
  take_point(&from->normal, to->normal);
  to->offset_m = from->offset;
  take_point(&from->least, to->from_m);
  take_point(&from->greatest, to->to_m);
}

static Corbot_WorkspaceInfo* get_workspace(PortableServer_Servant servant, CORBA_Environment* ev) {
  (void)ev;
  corbot_workspace now;
  corbot_robot_workspace(self_of(servant)->robot, &now);
  Corbot_WorkspaceInfo* result = Corbot_WorkspaceInfo__alloc();
  convert_shapes(now.shapes, now.profile_count, &result->profile);
  convert_shapes(now.shapes + now.profile_count, now.further_count, &result->further);
  result->known = now.known ? CORBA_TRUE : CORBA_FALSE;
  return result;
}

/* ORBit2 does not check the bound of the sequence. A truncated request gives NULL. */
static void set_workspace(PortableServer_Servant servant, const Corbot_WorkspaceShapes* further,
                          CORBA_Environment* ev) {
  const CORBA_unsigned_long count = further == NULL ? 0 : further->_length;
  if (further == NULL || count > CORBOT_MAX_SHAPES || (count > 0 && further->_buffer == NULL)) {
    CORBA_exception_set_system(ev, ex_CORBA_MARSHAL, CORBA_COMPLETED_NO);
    return;
  }
  corbot_shape wanted[CORBOT_MAX_FURTHER_SHAPES];
  for (CORBA_unsigned_long i = 0; i < count && i < CORBOT_MAX_FURTHER_SHAPES; ++i) {
    if (further->_buffer[i].name == NULL) {
      CORBA_exception_set_system(ev, ex_CORBA_MARSHAL, CORBA_COMPLETED_NO);
      return;
    }
    take_shape(&further->_buffer[i], &wanted[i]);
  }
  Caller room;
  corbot_error error;
  if (corbot_robot_set_workspace(self_of(servant)->robot, caller_of(servant, &room), wanted, count, &error) !=
      CORBOT_OK)
    raise_failure(&error, ev);
}

static void reset_workspace(PortableServer_Servant servant, CORBA_Environment* ev) {
  Caller room;
  corbot_error error;
  if (corbot_robot_reset_workspace(self_of(servant)->robot, caller_of(servant, &room), &error) != CORBOT_OK)
    raise_failure(&error, ev);
}

void arm_set_workspace(POA_Corbot_Arm__epv* arm) {
  arm->_get_Workspace = get_workspace;
  arm->SetWorkspace = set_workspace;
  arm->ResetWorkspace = reset_workspace;
}
