/* SPDX-License-Identifier: Apache-2.0
 *
 * How many stops had been counted when a request arrived: what arrived before a Stop must not be carried
 * out after it, however late its thread begins. Neither ORB tells when it has read a request. So a program
 * that is linked with this file takes the place of read() and recv() in the C library, for the connections
 * that it has accepted. Plain C, thread-safe, not real-time safe.
 *
 * A request has the number that was read before its last bytes were taken from the socket: a Stop that is
 * counted meanwhile ends it. What still lies in the socket comes later, with one exception: when this
 * process has not run for a second (frozen, or the machine stood still), what can be read by then arrived
 * at a time that nobody knows, and counts as from before the stops that other processes have counted
 * meanwhile. */
#ifndef CORBOT_NET_ARRIVALS_H
#define CORBOT_NET_ARRIVALS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Descriptors of connections; those beyond are refused: a table of fixed size needs no memory when a client
 * floods. */
enum { CORBOT_DESCRIPTORS = 2048 };

/* How many stops there have been, and how many of them other processes have counted. Thread-safe. */
typedef void (*corbot_count_stops)(void* context, uint64_t* all, uint64_t* by_others);

/* From now on arrivals are numbered, until corbot_arrivals_end. Before the ORB's start, after its end. */
void corbot_arrivals_start(corbot_count_stops count, void* context);
void corbot_arrivals_end(void);

/* Of the request whose last bytes this thread has read. */
uint64_t corbot_arrival(void);
/* Of that request of GIOP 1.2 on that connection, whichever thread has read its last bytes: requests in fragments may be
 * interleaved there. 0: not known, it is of an earlier version, or one of long ago. */
uint64_t corbot_arrival_of(int fd, uint32_t request);

/* A connection is accepted, and closed: from connections.c, one at a time. */
void corbot_arrivals_opened(int fd);
void corbot_arrivals_closed(int fd);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_NET_ARRIVALS_H */
