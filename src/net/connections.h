/* SPDX-License-Identifier: Apache-2.0
 *
 * The connections that this process has accepted, for servants on any ORB. Neither ORB bounds their number,
 * reports the loss of a call's peer, or allows setting up its sockets. A program that is linked with this
 * file therefore replaces accept() and close() of the C library: the ORB's calls come here. Plain C,
 * thread-safe, not real-time safe. */
#ifndef CORBOT_NET_CONNECTIONS_H
#define CORBOT_NET_CONNECTIONS_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  /* Most connections at once. One more closes the connection that has been idle for longest, of the host that
   * has most. */
  CORBOT_MOST_CONNECTIONS = 256,
  /* Descriptors that are left for all other uses. */
  CORBOT_RESERVED_DESCRIPTORS = 64,
  CORBOT_PEER_TEXT = 64
};

/* One accepted connection. Its number is used once, its descriptor repeatedly; number 0: none. */
typedef struct corbot_connection {
  int fd;
  uint64_t number;
} corbot_connection;

/* The other end: a host (IPv4 address, IPv6 network of 64 bits), or a process on a Unix socket. */
typedef struct corbot_peer {
  int family;
  uint64_t id;
} corbot_peer;

/* Raises the limit of descriptors to the hard one and begins to count accepted connections. To be called
 * before the ORB's start. */
void corbot_connections_start(void);
/* Leaves the closing of accepted connections to another thread. From now on close() takes no lock. omniORB
 * needs this, because it closes connections while it holds locks that every call takes. ORBit2 cannot have
 * it: its servant gets the events of a descriptor until it is closed. If no thread can be had, close()
 * closes. */
void corbot_connections_close_elsewhere(void);

/* Starts accepting connections. Until then clients wait in the listen queue: an ORB listens before its
 * objects exist, and would reply that they do not exist. */
void corbot_connections_serve(void);
/* Stops accepting. Closes idle connections; shuts down reading on those with a call in
 * progress. An ORB that ends while requests arrive replies that its objects do not exist, or crashes. To be
 * called when no call waits any more. */
void corbot_connections_end(void);
/* Closes the listening sockets after corbot_connections_end(): no client can connect any more, and the ORB
 * gets no event from these sockets. Used by ORBit2, which crashes if a client connects while it ends; omniORB
 * connects to itself at that time. */
void corbot_connections_close_listeners(void);
/* Returns true after corbot_connections_end(): data that is read now was in a socket, and its client sends it
 * again. */
bool corbot_connections_ended(void);

/* Announces that this process will connect to its own address from that local TCP port. The connection counts
 * for no bound and never closes when idle, like every one over a Unix socket from this process. The servant
 * uses it to check that it responds, whatever other clients do. One port at a time. */
void corbot_connections_expect_own(int port);
/* Takes and releases the lock that every accepted connection and every call takes. The check whether this
 * process responds thus also detects a lock that is never released. */
void corbot_connections_pass(void);

/* Returns the connection with that descriptor, and notes that it was used now. */
corbot_connection corbot_connection_used(int fd);
/* Marks the connection as carrying a call, so it is not idle. Returns false if it was closed because it was
 * idle. Its client has then been informed that nothing it sent meanwhile is carried out, and may repeat the
 * call. */
bool corbot_connection_begin_call(corbot_connection connection);
void corbot_connection_end_call(corbot_connection connection);
/* Returns true if the peer is still connected. Returns false after it has closed, reset, or acknowledged
 * nothing for six seconds. */
bool corbot_connection_lives(corbot_connection connection);
corbot_peer corbot_connection_peer(corbot_connection connection);
/* Writes the peer as text with the port: "127.0.0.1:51234", "[::1]:51234", "local uid 1000"; empty: not
 * known, or gone. */
void corbot_connection_peer_text(corbot_connection connection, char out[CORBOT_PEER_TEXT]);
bool corbot_peer_equal(corbot_peer a, corbot_peer b);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_NET_CONNECTIONS_H */
