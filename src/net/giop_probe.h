/* SPDX-License-Identifier: Apache-2.0
 *
 * Whether an ORB answers at its own address: a LocateRequest of GIOP 1.0, which costs the ORB a look into
 * its tables, over a connection that is kept. Plain C, so that both servants can use it. */
#ifndef CORBOT_NET_GIOP_PROBE_H
#define CORBOT_NET_GIOP_PROBE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct corbot_giop_probe {
  char host[256]; /* empty where unix_path is set */
  char port[8];
  char unix_path[108];
  char key[64];
  int fd; /* -1: not connected */
  uint32_t request;
  int is_here; /* what the last answer said: the object is served, without a forward */
} corbot_giop_probe;

/* `unix_path` may be NULL; where it is set it is used, and host and port are not. */
void corbot_giop_probe_init(corbot_giop_probe* probe, const char* host, int port, const char* unix_path,
                            const char* key);
/* 1: the ORB has answered, in `timeout_ms` at the most, not counting time in which this process did not
 * run. What it says about the object is in is_here. 0: it has not; the next call tries anew, on a new
 * connection. */
int corbot_giop_probe_answers(corbot_giop_probe* probe, int timeout_ms);
void corbot_giop_probe_close(corbot_giop_probe* probe);

#ifdef __cplusplus
}
#endif

#endif
