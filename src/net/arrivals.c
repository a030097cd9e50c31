/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#undef _FORTIFY_SOURCE /* would define read() and recv() in the headers */
#include "net/arrivals.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

enum { kHeader = 12, kMinor = 5, kFlags = 6, kType = 7, kSize = 8, kId = 4 };
enum { kRequest = 0, kFragment = 7 };
/* Most requests of one connection that are read and not begun: more than an ORB has threads for. */
enum { kNumbered = 64 };

static const int64_t kTick_ns = 100000000;
static const int64_t kGap_ns = 1000000000;
/* Connections accepted within this time after a gap may have waited since before the gap. */
static const int kTicksAfterGap = 10;

/* The number of a request. One thread at a time, the one that reads the connection, writes it; all threads
 * read it. */
typedef struct Numbered {
  _Atomic uint64_t key; /* number of the request plus 1; 0: none, or being written */
  _Atomic uint64_t stops;
} Numbered;

/* The number of some bytes that are still to be read. */
typedef struct Numbers {
  _Atomic int bytes; /* 0 or less: none */
  _Atomic uint64_t stops;
} Numbers;

/* The position of a connection within its messages. The ORB lets one thread read at a time. */
typedef struct Stream {
  _Atomic bool open;
  bool unframed; /* no GIOP: the ORB will close the connection */
  int header_count;
  unsigned char header[kHeader];
  uint32_t body_left;
  int id_count;
  unsigned char id[kId]; /* first bytes of the body: in GIOP 1.2 the number of the request */
  unsigned next_numbered;
  Numbered numbered[kNumbered];
  /* Readable bytes that have a number already, after a gap or before a Stop, in their order. */
  Numbers numbers[2];
} Stream;

static Stream streams[CORBOT_DESCRIPTORS];
static _Thread_local uint64_t arrival;

static corbot_count_stops _Atomic count_stops;
static void* count_context;

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER; /* guards the members below */
static pthread_cond_t end_requested = PTHREAD_COND_INITIALIZER;
static pthread_t ticker;
static bool is_ticking;
static bool end;
static _Atomic int64_t ran_ns;  /* when this process was last known to run; 0: not started */
static uint64_t by_others_then; /* stops of other processes at that time */
static int ticks_after_gap;
static uint64_t by_others_before_gap;

static int64_t now_ns(void) {
  struct timespec now;
  (void)clock_gettime(CLOCK_MONOTONIC, &now);
  return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static void count(uint64_t* all, uint64_t* by_others) {
  *all = *by_others = 0;
  corbot_count_stops function = atomic_load(&count_stops);
  if (function != NULL) function(count_context, all, by_others);
}

/* If another thread reads the connection meanwhile, too many bytes may have a number, never too few. */
void corbot_arrivals_number(int fd, uint64_t number) {
  int bytes = 0;
  if (fd < 0 || fd >= CORBOT_DESCRIPTORS || ioctl(fd, FIONREAD, &bytes) != 0 || bytes <= 0) return;
  Numbers* first = &streams[fd].numbers[0];
  Numbers* second = &streams[fd].numbers[1];
  const int behind = atomic_load(&second->bytes);
  if (atomic_load(&first->bytes) <= 0 && behind > 0) {
    atomic_store(&first->stops, atomic_load(&second->stops));
    atomic_store(&first->bytes, behind);
    atomic_store(&second->bytes, 0);
  }
  const int before = atomic_load(&first->bytes);
  Numbers* last = before > 0 ? second : first;
  if (atomic_load(&last->bytes) <= 0) atomic_store(&last->stops, number);
  atomic_store(&last->bytes, before > 0 ? bytes - before : bytes);
}

/* Assigns a number to the bytes that are readable after a gap. The number excludes the stops that other
 * processes counted during the gap. It includes those of this process, which counts them only while it runs.
 * The caller holds the mutex. */
static void number_after_gap(int fd) {
  uint64_t all = 0;
  uint64_t by_others = 0;
  count(&all, &by_others);
  corbot_arrivals_number(fd, all - by_others + by_others_before_gap);
}

/* Checks whether this process has run recently, and reads the number of stops. After a gap the first thread
 * to run comes here before anything is read. The stops are counted before the clock is read: a freeze in
 * between is a gap, and one after it is a gap for the next look. The caller holds the mutex. */
static void look(void) {
  uint64_t all = 0;
  uint64_t by_others = 0;
  count(&all, &by_others);
  const int64_t now = now_ns();
  const int64_t ran = atomic_load(&ran_ns);
  if (ran != 0 && now - ran >= kGap_ns) {
    /* Soon after another gap, a connection that waits to be accepted may be older than that gap. */
    if (ticks_after_gap == 0) by_others_before_gap = by_others_then;
    ticks_after_gap = kTicksAfterGap;
    for (int fd = 0; fd < CORBOT_DESCRIPTORS; ++fd) {
      if (atomic_load(&streams[fd].open)) number_after_gap(fd);
    }
  }
  by_others_then = by_others;
  atomic_store(&ran_ns, now);
}

static void* tick(void* unused) {
  (void)unused;
  pthread_mutex_lock(&mutex);
  while (!end) {
    look();
    if (ticks_after_gap > 0) --ticks_after_gap;
    const int64_t until_ns = now_ns() + kTick_ns;
    const struct timespec until = {(time_t)(until_ns / 1000000000), (long)(until_ns % 1000000000)};
    if (!end) (void)pthread_cond_clockwait(&end_requested, &mutex, CLOCK_MONOTONIC, &until);
  }
  pthread_mutex_unlock(&mutex);
  return NULL;
}

void corbot_arrivals_start(corbot_count_stops function, void* context) {
  count_context = context;
  atomic_store(&count_stops, function);
  pthread_mutex_lock(&mutex);
  end = false;
  is_ticking = pthread_create(&ticker, NULL, tick, NULL) == 0;
  pthread_mutex_unlock(&mutex);
}

void corbot_arrivals_end(void) {
  pthread_mutex_lock(&mutex);
  const bool joins = is_ticking;
  is_ticking = false;
  end = true;
  pthread_cond_signal(&end_requested);
  pthread_mutex_unlock(&mutex);
  if (joins) pthread_join(ticker, NULL);
  atomic_store(&ran_ns, 0);
  atomic_store(&count_stops, NULL);
}

/* Returns the number of what is read next. This order matters: a freeze or a Stop between any two of these
 * steps and the read makes the number too old, never too new. */
uint64_t corbot_arrivals_now(void) {
  uint64_t stops = 0;
  uint64_t by_others = 0;
  count(&stops, &by_others);
  const int64_t ran = atomic_load(&ran_ns);
  if (ran != 0 && now_ns() - ran >= kGap_ns) {
    pthread_mutex_lock(&mutex);
    look();
    pthread_mutex_unlock(&mutex);
  }
  return stops;
}

uint64_t corbot_arrival(void) { return arrival; }

uint64_t corbot_arrival_of(int fd, uint32_t request) {
  if (fd < 0 || fd >= CORBOT_DESCRIPTORS) return 0;
  const uint64_t key = (uint64_t)request + 1;
  for (int i = 0; i < kNumbered; ++i) {
    Numbered* numbered = &streams[fd].numbered[i];
    if (atomic_load(&numbered->key) != key) continue;
    const uint64_t stops = atomic_load(&numbered->stops);
    if (atomic_load(&numbered->key) == key) return stops;
  }
  return 0;
}

void corbot_arrivals_opened(int fd) {
  Stream* stream = &streams[fd];
  stream->unframed = false;
  stream->header_count = 0;
  stream->body_left = 0;
  stream->id_count = 0;
  for (int i = 0; i < kNumbered; ++i) atomic_store(&stream->numbered[i].key, 0);
  for (int i = 0; i < 2; ++i) atomic_store(&stream->numbers[i].bytes, 0);
  pthread_mutex_lock(&mutex);
  if (is_ticking) look();
  if (ticks_after_gap > 0) number_after_gap(fd);
  atomic_store(&stream->open, true);
  pthread_mutex_unlock(&mutex);
}

void corbot_arrivals_closed(int fd) { atomic_store(&streams[fd].open, false); }

/* Returns at most the bytes of one message, so that the thread that reads a request also carries it out. */
static size_t within_message(const Stream* stream, size_t size) {
  if (stream->unframed) return size;
  const size_t left = stream->body_left > 0 ? stream->body_left : (size_t)(kHeader - stream->header_count);
  return size < left ? size : left;
}

/* Returns the integer in the byte order of the message. */
static uint32_t integer(const Stream* stream, const unsigned char bytes[4]) {
  const bool little_endian = (stream->header[kFlags] & 1) != 0;
  uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value |= (uint32_t)bytes[i] << (little_endian ? 8 * i : 24 - 8 * i);
  return value;
}

static void follow(Stream* stream, const unsigned char* bytes, size_t size) {
  if (stream->unframed) return;
  if (stream->body_left > 0) {
    for (size_t i = 0; i < size && stream->id_count < kId; ++i) stream->id[stream->id_count++] = bytes[i];
    stream->body_left -= (uint32_t)size;
    return;
  }
  memcpy(stream->header + stream->header_count, bytes, size);
  stream->header_count += (int)size;
  if (stream->header_count < kHeader) return;
  stream->header_count = 0;
  stream->id_count = 0;
  stream->body_left = integer(stream, stream->header + kSize);
  stream->unframed = memcmp(stream->header, "GIOP", 4) != 0;
}

/* Notes the end of a message. If it identifies its request, that request has this number from now on. */
static void note_end(Stream* stream, uint64_t stops) {
  const int type = stream->header[kType];
  if (stream->unframed || stream->header_count > 0 || stream->body_left > 0 || stream->id_count < kId) return;
  if (stream->header[kMinor] < 2 || (type != kRequest && type != kFragment)) return;
  const uint64_t key = (uint64_t)integer(stream, stream->id) + 1;
  Numbered* chosen = NULL;
  for (int i = 0; i < kNumbered && chosen == NULL; ++i) {
    if (atomic_load(&stream->numbered[i].key) == key) chosen = &stream->numbered[i];
  }
  if (chosen == NULL) chosen = &stream->numbered[stream->next_numbered++ % kNumbered];
  atomic_store(&chosen->key, 0);
  atomic_store(&chosen->stops, stops);
  atomic_store(&chosen->key, key);
}

/* Returns the number of the first of the bytes that were read: the older one, if some have the next. */
static uint64_t number_of(Stream* stream, ssize_t size, uint64_t stops) {
  uint64_t number = stops;
  bool has_number = false;
  int left = (int)size;
  for (int i = 0; i < 2 && left > 0; ++i) {
    Numbers* numbers = &stream->numbers[i];
    const int bytes = atomic_load(&numbers->bytes);
    if (bytes <= 0) continue;
    if (!has_number) number = atomic_load(&numbers->stops);
    has_number = true;
    atomic_fetch_sub(&numbers->bytes, left < bytes ? left : bytes);
    left -= bytes;
  }
  return number;
}

static ssize_t receive(int fd, void* bytes, size_t size, int flags) {
  Stream* stream = &streams[fd];
  size = within_message(stream, size);
  for (;;) {
    const uint64_t stops = corbot_arrivals_now();
    const ssize_t received = recvfrom(fd, bytes, size, flags | MSG_DONTWAIT, NULL, NULL);
    if (received > 0) {
      follow(stream, bytes, (size_t)received);
      arrival = number_of(stream, received, stops);
      note_end(stream, arrival);
    }
    if (received >= 0 || (errno != EAGAIN && errno != EWOULDBLOCK) || (flags & MSG_DONTWAIT) != 0)
      return received;
    if ((fcntl(fd, F_GETFL) & O_NONBLOCK) != 0) {
      errno = EAGAIN;
      return -1;
    }
    struct pollfd polled = {fd, POLLIN, 0};
    if (poll(&polled, 1, -1) < 0) return -1;
  }
}

static bool is_ours(int fd) {
  return fd >= 0 && fd < CORBOT_DESCRIPTORS && atomic_load_explicit(&streams[fd].open, memory_order_acquire);
}

/* Replaces the C library's function for the ORB; declared like it. */
ssize_t recv(int fd, void* bytes, size_t size, int flags) {
  if (is_ours(fd) && (flags & ~MSG_DONTWAIT) == 0) return receive(fd, bytes, size, flags);
  return recvfrom(fd, bytes, size, flags, NULL, NULL);
}

ssize_t read(int fd, void* bytes, size_t size) {
  if (is_ours(fd)) return receive(fd, bytes, size, 0);
  return syscall(SYS_read, fd, bytes, size);
}
