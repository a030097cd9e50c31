/* SPDX-License-Identifier: Apache-2.0
 *
 * Records how many stops had been counted when a request arrived. A request that arrived before a Stop must
 * not be carried out after it, however late its thread begins. Neither ORB reports when it has read a
 * request. A program that is linked with this file therefore replaces read() and recv() of the C library for
 * the connections that it has accepted. Plain C, thread-safe, not real-time safe.
 *
 * A request gets the number that was read before its last bytes were taken from the socket: a Stop that is
 * counted meanwhile ends it. Bytes that are still in the socket count as later, with one exception. If this
 * process has not run for a second (frozen, or the machine was suspended), the arrival time of the readable
 * bytes is unknown. They then count as older than the stops that other processes have counted meanwhile. */
#ifndef CORBOT_NET_ARRIVALS_H
#define CORBOT_NET_ARRIVALS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Number of descriptors for connections; those beyond are refused. A table of fixed size needs no memory when
 * a client floods. */
enum { CORBOT_DESCRIPTORS = 2048 };

/* Reads the number of stops, and how many of them other processes have counted. Thread-safe. */
typedef void (*corbot_count_stops)(void* context, uint64_t* all, uint64_t* by_others);

/* Numbers arrivals from now on, until corbot_arrivals_end. To be called before the ORB's start and after its
 * end. */
void corbot_arrivals_start(corbot_count_stops count, void* context);
void corbot_arrivals_end(void);

/* For an ORB that reads connections with a Stop before others. Returns the number of what arrives now. */
uint64_t corbot_arrivals_now(void);
/* Gives a number to the readable bytes of a connection. They keep the number until the thread that calls
 * this, which reads all connections, has read them. Bytes that have an earlier number keep it. A connection
 * has two numbers at most: bytes behind those of the second have the second, too. Takes no lock. */
void corbot_arrivals_number(int fd, uint64_t number);

/* Returns the number of the request whose last bytes this thread has read. */
uint64_t corbot_arrival(void);
/* Returns the number of that request of GIOP 1.2 on that connection. Any thread may have read its last bytes,
 * because fragmented requests may be interleaved. Returns 0 for a request that is too old, or of an earlier
 * version of GIOP. */
uint64_t corbot_arrival_of(int fd, uint32_t request);

/* Note that a connection is accepted or closed. connections.c calls them, one at a time. */
void corbot_arrivals_opened(int fd);
void corbot_arrivals_closed(int fd);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_NET_ARRIVALS_H */
