/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/waiting_calls.h"

void waiting_calls_init(WaitingCalls* calls, int capacity) {
  atomic_init(&calls->held, 0);
  calls->capacity = capacity;
}

bool waiting_calls_enter(WaitingCalls* calls) {
  if (atomic_fetch_add(&calls->held, 1) < calls->capacity) return true;
  waiting_calls_leave(calls);
  return false;
}

void waiting_calls_leave(WaitingCalls* calls) { atomic_fetch_sub(&calls->held, 1); }

bool waiting_calls_idle(WaitingCalls* calls) { return atomic_load(&calls->held) == 0; }
