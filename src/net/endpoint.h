/* SPDX-License-Identifier: Apache-2.0
 *
 * Addresses to listen on, in C, for the servants and the command line. Nothing here is real-time safe. */
#ifndef CORBOT_NET_ENDPOINT_H
#define CORBOT_NET_ENDPOINT_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { CORBOT_HOST = 256, CORBOT_WHY = 320 };

typedef struct corbot_endpoint {
  char host[CORBOT_HOST];
  int port;
} corbot_endpoint;

/* Splits "HOST:PORT" or "[IPV6]:PORT" (the host is without the brackets), port 1 to 65535. Returns false with
 * the reason in `why` for any other text, and for a host that means every interface (corbot_is_wildcard).
 * Clients need one address for this machine. */
bool corbot_endpoint_parse(const char* text, corbot_endpoint* out, char why[CORBOT_WHY]);
/* Joins host and port, with brackets around a host with colons; `out` has room for CORBOT_HOST + 16. */
void corbot_endpoint_text(const char* host, int port, char* out, size_t size);

/* Returns true if a host means every interface of this machine: 0.0.0.0 in any form that the C library reads
 * (0, 0x0, 0.0), ::, an empty host, or an asterisk. */
bool corbot_is_wildcard(const char* host);
bool corbot_is_ipv6(const char* host);
/* Returns true for a host of the loopback interface: 127.x.y.z, ::1, or localhost. */
bool corbot_is_loopback(const char* host);

/* Opens a listening socket like an ORB; port 0: the kernel selects one. Returns -1 with the reason in `why`
 * if that is not possible, or the host is a wildcard. *bound_port is the port. The caller closes the socket.
 */
int corbot_listen(const char* host, int port, int* bound_port, char why[CORBOT_WHY]);

/* Returns the socket of this process that listens on host:port, or -1. */
int corbot_listening_socket(const char* host, int port);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_NET_ENDPOINT_H */
