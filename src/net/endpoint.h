/* SPDX-License-Identifier: Apache-2.0
 *
 * Addresses to listen on, in C, for the servants and the command line. Nothing here is real-time safe. */
#ifndef CORBOT_NET_ENDPOINT_H
#define CORBOT_NET_ENDPOINT_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { CORBOT_HOST = 256, CORBOT_WHY = 320 };

typedef struct corbot_endpoint {
  char host[CORBOT_HOST];
  int port;
} corbot_endpoint;

/* Splits "HOST:PORT", port 1 to 65535. False, and what is wrong in `why`, for anything else and for a host
 * that means every interface (0.0.0.0, *): clients need one address by which to reach this machine. */
bool corbot_endpoint_parse(const char* text, corbot_endpoint* out, char why[CORBOT_WHY]);

/* Whether a host is one of the loopback interface: 127.x.y.z or localhost. */
bool corbot_is_loopback(const char* host);

/* A listening IPv4 socket, as an ORB would open it; port 0: one that the kernel chooses. -1, and what is
 * wrong in `why`, when that is not possible. *bound_port is the port. The caller closes. */
int corbot_listen(const char* host, int port, int* bound_port, char why[CORBOT_WHY]);

/* The socket of this very process that listens on host:port; -1 when there is none. */
int corbot_listening_socket(const char* host, int port);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_NET_ENDPOINT_H */
