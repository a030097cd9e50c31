/* SPDX-License-Identifier: Apache-2.0
 *
 * Checks whether an ORB answers at its own address. Sends a LocateRequest of GIOP 1.0, which the ORB answers
 * from its tables, over a connection that stays open. Plain C, so that both servants can use it. */
#ifndef CORBOT_NET_GIOP_PROBE_H
#define CORBOT_NET_GIOP_PROBE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct corbot_giop_probe {
  char host[256]; /* empty if unix_path is set */
  char port[8];
  char unix_path[108];
  char key[64];
  int fd; /* -1: not connected */
  uint32_t request;
  int is_here; /* from the last answer: the object is served, without a forward */
} corbot_giop_probe;

/* `unix_path` may be NULL; if it is set, it replaces host and port. */
void corbot_giop_probe_init(corbot_giop_probe* probe, const char* host, int port, const char* unix_path,
                            const char* key);
/* Returns 1 if the ORB has answered within `timeout_ms`, not counting time in which this process did not run.
 * is_here then holds the answer on the object. Returns 0 if the ORB has not answered; the next call tries
 * again on a new connection. */
int corbot_giop_probe_answers(corbot_giop_probe* probe, int timeout_ms);
void corbot_giop_probe_close(corbot_giop_probe* probe);

#ifdef __cplusplus
}
#endif

#endif
