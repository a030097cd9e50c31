/* SPDX-License-Identifier: Apache-2.0
 *
 * The connections that this process has accepted, for servants on any ORB. Neither ORB bounds them, tells
 * when the peer of a call has gone, or lets its sockets be set up. So a program that is linked with this file
 * takes the place of accept() and close() in the C library: the ORB's calls come here. Plain C, thread-safe,
 * not real-time safe. */
#ifndef CORBOT_NET_CONNECTIONS_H
#define CORBOT_NET_CONNECTIONS_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  /* At once; with one more the connection that has been idle for longest, of the host that has most, is
   * closed. */
  CORBOT_MOST_CONNECTIONS = 256,
  /* Descriptors that are left for everything else. */
  CORBOT_RESERVED_DESCRIPTORS = 64,
  CORBOT_PEER_TEXT = 64
};

/* One accepted connection. Its number is given once, its descriptor again and again; number 0: none. */
typedef struct corbot_connection {
  int fd;
  uint64_t number;
} corbot_connection;

/* Who is at the other end: a host (IPv4 address, IPv6 network of 64 bits), or a process on a Unix socket. */
typedef struct corbot_peer {
  int family;
  uint64_t id;
} corbot_peer;

/* Raises the limit of descriptors to the hard one and begins to count what is accepted. Before the ORB's
 * start. */
void corbot_connections_start(void);

/* Who connects is accepted from now on, and waits before: an ORB listens before its objects are there, and would
 * say that they do not exist. */
void corbot_connections_serve(void);
/* Nobody any more, and every connection without a call is closed as an idle one is, of the others the way in: an ORB
 * that ends while requests arrive says that its objects do not exist, or crashes. When no call waits any more. */
void corbot_connections_end(void);
/* After that: nobody can connect any more, and the ORB hears nothing of those sockets. For ORBit2, which crashes where
 * someone connects while it ends; omniORB connects to itself then. */
void corbot_connections_close_listeners(void);
/* Whether corbot_connections_end() was called: what is read now lay in a socket, and its client sends it again. */
bool corbot_connections_ended(void);

/* This process is about to connect to its own address from that local TCP port. The connection counts for
 * no bound and is never closed for its idleness, like every one over a Unix socket from this process: by it
 * the servant finds out that it responds, whatever others do. One port at a time. */
void corbot_connections_expect_own(int port);
/* Takes and leaves the lock that every accepted connection and every call takes: whoever finds out whether this process
 * responds is to find out, too, where nobody leaves it any more. */
void corbot_connections_pass(void);

/* The connection whose descriptor that is, noted as used now. */
corbot_connection corbot_connection_used(int fd);
/* It carries a call from now on and is not idle. False when it has been closed for its idleness: its client
 * has been told that nothing it sent meanwhile is carried out, and may send the call again. */
bool corbot_connection_begin_call(corbot_connection connection);
void corbot_connection_end_call(corbot_connection connection);
/* Whether the peer is still there: not once it has closed, or reset, or has acknowledged nothing for six
 * seconds. */
bool corbot_connection_lives(corbot_connection connection);
corbot_peer corbot_connection_peer(corbot_connection connection);
/* The same for a person, with the port: "127.0.0.1:51234", "[::1]:51234", "local uid 1000"; empty: not known, or gone. */
void corbot_connection_peer_text(corbot_connection connection, char out[CORBOT_PEER_TEXT]);
bool corbot_peer_equal(corbot_peer a, corbot_peer b);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_NET_CONNECTIONS_H */
