/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include "net/connections.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "net/arrivals.h"

enum { kDescriptors = CORBOT_DESCRIPTORS, kBytesInWord = 8, kMostListeners = 8 };

/* A silent peer is probed after 3 s, and the connection fails if the peer has acknowledged nothing for 6 s.
 */
static const int kKeepIdle_s = 3;
static const int kKeepInterval_s = 2;
static const unsigned kUnacknowledged_ms = 6000;

typedef struct Entry {
  _Atomic uint64_t number; /* 0: no accepted connection; it does not change while the descriptor is in use */
  int64_t used_ns;
  corbot_peer peer;
  int calls;
  bool own;          /* from this process */
  bool ending;       /* closed because it was idle; the ORB has yet to notice */
  _Atomic bool left; /* the ORB has closed it, and another thread will */
} Entry;

typedef enum Phase { kStarting, kServing, kEnded } Phase;

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static _Atomic Phase phase = kStarting;
static int listeners[kMostListeners]; /* sockets from which connections were accepted */
static int listener_count;
static Entry entries[kDescriptors]; /* by descriptor */
static uint64_t last_number;
static int most; /* 0: not started */
static int open_count;
static int ending_count;
static int64_t full_since_ns;   /* with as many ended connections as fit; 0: there is room */
static int own_port;            /* 0: none is expected */
static int to_close[2];         /* a pipe of descriptors, to the thread that closes them */
static _Atomic int closer = -1; /* its end for close(); -1: close() closes */

static int64_t now_ns(void) {
  struct timespec now;
  (void)clock_gettime(CLOCK_MONOTONIC, &now);
  return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static Entry* find(corbot_connection connection) {
  if (connection.fd < 0 || connection.fd >= kDescriptors || connection.number == 0) return NULL;
  Entry* entry = &entries[connection.fd];
  return entry->number == connection.number && !entry->left ? entry : NULL;
}

void corbot_connections_start(void) {
  struct rlimit limit = {kDescriptors, kDescriptors};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    limit.rlim_cur = limit.rlim_max < kDescriptors ? limit.rlim_max : kDescriptors;
    (void)setrlimit(RLIMIT_NOFILE, &limit);
    (void)getrlimit(RLIMIT_NOFILE, &limit);
  }
  const int descriptors = limit.rlim_cur < kDescriptors ? (int)limit.rlim_cur : kDescriptors;
  /* The same number of connections may be about to close. */
  const int room = (descriptors - CORBOT_RESERVED_DESCRIPTORS) / 2;
  pthread_mutex_lock(&mutex);
  most = room < CORBOT_MOST_CONNECTIONS ? room : CORBOT_MOST_CONNECTIONS;
  if (most < 1) most = 1;
  pthread_mutex_unlock(&mutex);
}

static corbot_peer peer_of(int fd) {
  corbot_peer peer = {AF_UNSPEC, 0};
  struct sockaddr_storage address = {0};
  socklen_t size = sizeof(address);
  if (getpeername(fd, (struct sockaddr*)&address, &size) != 0) return peer;
  peer.family = address.ss_family;
  if (address.ss_family == AF_INET) {
    peer.id = ((const struct sockaddr_in*)&address)->sin_addr.s_addr;
  } else if (address.ss_family == AF_INET6) {
    const struct in6_addr* ip = &((const struct sockaddr_in6*)&address)->sin6_addr;
    if (IN6_IS_ADDR_V4MAPPED(ip)) {
      uint32_t ipv4 = 0;
      memcpy(&ipv4, &ip->s6_addr[12], sizeof(ipv4));
      peer.family = AF_INET;
      peer.id = ipv4;
    } else {
      memcpy(&peer.id, ip->s6_addr, kBytesInWord); /* a network of 64 bits counts as one host */
    }
  } else if (address.ss_family == AF_UNIX) {
    struct ucred credentials = {0};
    size = sizeof(credentials);
    if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size) == 0)
      peer.id = (uint64_t)credentials.pid;
  }
  return peer;
}

static int port_of(const struct sockaddr_storage* address) {
  if (address->ss_family == AF_INET) return ntohs(((const struct sockaddr_in*)address)->sin_port);
  return ntohs(((const struct sockaddr_in6*)address)->sin6_port);
}

/* Returns true if this process has connected to itself. No other process on this machine has the port. */
static bool is_own(int fd, corbot_peer peer) {
  if (peer.family == AF_UNIX) return peer.id == (uint64_t)getpid();
  if ((peer.family != AF_INET && peer.family != AF_INET6) || own_port == 0) return false;
  struct sockaddr_storage remote = {0};
  struct sockaddr_storage local = {0};
  socklen_t size = sizeof(remote);
  if (getpeername(fd, (struct sockaddr*)&remote, &size) != 0 || port_of(&remote) != own_port) return false;
  size = sizeof(local);
  if (getsockname(fd, (struct sockaddr*)&local, &size) != 0) return false;
  if (remote.ss_family == AF_INET)
    return ((struct sockaddr_in*)&remote)->sin_addr.s_addr == ((struct sockaddr_in*)&local)->sin_addr.s_addr;
  return memcmp(&((struct sockaddr_in6*)&remote)->sin6_addr, &((struct sockaddr_in6*)&local)->sin6_addr,
                sizeof(struct in6_addr)) == 0;
}

void corbot_connections_expect_own(int port) {
  pthread_mutex_lock(&mutex);
  own_port = port;
  pthread_mutex_unlock(&mutex);
}

static void peer_text_of(int fd, char out[CORBOT_PEER_TEXT]) {
  struct sockaddr_storage address = {0};
  socklen_t size = sizeof(address);
  char host[INET6_ADDRSTRLEN] = "";
  if (getpeername(fd, (struct sockaddr*)&address, &size) != 0) return;
  if (address.ss_family == AF_INET) {
    const struct sockaddr_in* ipv4 = (const struct sockaddr_in*)&address;
    (void)inet_ntop(AF_INET, &ipv4->sin_addr, host, sizeof(host));
    (void)snprintf(out, CORBOT_PEER_TEXT, "%s:%u", host, ntohs(ipv4->sin_port));
  } else if (address.ss_family == AF_INET6) {
    const struct sockaddr_in6* ipv6 = (const struct sockaddr_in6*)&address;
    (void)inet_ntop(AF_INET6, &ipv6->sin6_addr, host, sizeof(host));
    (void)snprintf(out, CORBOT_PEER_TEXT, "[%s]:%u", host, ntohs(ipv6->sin6_port));
  } else if (address.ss_family == AF_UNIX) {
    struct ucred credentials = {0};
    size = sizeof(credentials);
    if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size) == 0)
      (void)snprintf(out, CORBOT_PEER_TEXT, "local uid %u", (unsigned)credentials.uid);
  }
}

static void set_up(int fd, int family) {
  if (family != AF_INET && family != AF_INET6) return;
  const int on = 1;
  (void)setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof(on));
  (void)setsockopt(fd, IPPROTO_TCP, TCP_KEEPIDLE, &kKeepIdle_s, sizeof(kKeepIdle_s));
  (void)setsockopt(fd, IPPROTO_TCP, TCP_KEEPINTVL, &kKeepInterval_s, sizeof(kKeepInterval_s));
  (void)setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnacknowledged_ms, sizeof(kUnacknowledged_ms));
}

static int connections_of(corbot_peer peer) {
  int count = 0;
  for (int i = 0; i < kDescriptors; ++i) {
    count += entries[i].number != 0 && !entries[i].own && !entries[i].ending &&
             corbot_peer_equal(entries[i].peer, peer);
  }
  return count;
}

/* Ends a connection without a call. The ORB reads its end and frees the descriptor. */
static void end_connection(int fd) {
  entries[fd].ending = true;
  ++ending_count;
  /* After this message a client opens another connection for its next call without an error. */
  static const unsigned char close_connection[] = {'G', 'I', 'O', 'P', 1, 2, 0, 5, 0, 0, 0, 0};
  (void)send(fd, close_connection, sizeof(close_connection), MSG_DONTWAIT | MSG_NOSIGNAL);
  (void)shutdown(fd, SHUT_RDWR);
}

void corbot_connections_serve(void) { phase = kServing; }

void corbot_connections_end(void) {
  phase = kEnded; /* connections added before have read the previous phase with the lock held */
  pthread_mutex_lock(&mutex);
  for (int fd = 0; fd < kDescriptors; ++fd) {
    if (entries[fd].number == 0 || entries[fd].ending) continue;
    if (entries[fd].calls > 0) {
      (void)shutdown(fd, SHUT_RD);
    } else {
      end_connection(fd);
    }
  }
  pthread_mutex_unlock(&mutex);
}

/* Replaces each listener by an object that is never ready: the ORB may be waiting for the descriptor, and
 * closes it. */
void corbot_connections_close_listeners(void) {
  const int silent = eventfd(0, EFD_CLOEXEC);
  if (silent < 0) return;
  pthread_mutex_lock(&mutex);
  for (int i = 0; i < listener_count; ++i) (void)dup3(silent, listeners[i], O_CLOEXEC);
  pthread_mutex_unlock(&mutex);
  (void)close(silent);
}

bool corbot_connections_ended(void) { return phase == kEnded; }

/* Closes one connection without a call: the least recently used one of the host that has most of them. */
static void make_room(void) {
  Entry* chosen = NULL;
  int chosen_count = 0;
  corbot_peer counted = {AF_UNSPEC, 0};
  int count = 0;
  for (int i = 0; i < kDescriptors; ++i) {
    Entry* entry = &entries[i];
    if (entry->number == 0 || entry->own || entry->ending || entry->calls > 0) continue;
    if (count == 0 || !corbot_peer_equal(entry->peer, counted)) {
      counted = entry->peer;
      count = connections_of(counted);
    }
    if (chosen == NULL || count > chosen_count ||
        (count == chosen_count && entry->used_ns < chosen->used_ns)) {
      chosen = entry;
      chosen_count = count;
    }
  }
  if (chosen == NULL) return;
  end_connection((int)(chosen - entries));
}

/* Adds a connection. Returns false if there is no space for it. */
static bool add(int fd) {
  if (fd >= kDescriptors) return false;
  const corbot_peer peer = peer_of(fd);
  const bool own = is_own(fd, peer);
  if (!own && open_count - ending_count >= most) make_room();
  if (!own && (open_count - ending_count >= most || open_count >= 2 * most)) return false;
  Entry* entry = &entries[fd];
  entry->left = false;
  entry->number = ++last_number;
  entry->used_ns = now_ns();
  entry->peer = peer;
  entry->own = own;
  entry->calls = 0;
  entry->ending = false;
  if (!own) ++open_count;
  set_up(fd, entry->peer.family);
  corbot_arrivals_opened(fd);
  return true;
}

static void forget(int fd) {
  if (entries[fd].number == 0) return; /* closed twice, by two threads */
  if (entries[fd].ending) --ending_count;
  entries[fd].number = 0;
  if (!entries[fd].own) --open_count;
  corbot_arrivals_closed(fd);
}

static bool may_accept(void) {
  static const int64_t longest_ns = 500000000;
  pthread_mutex_lock(&mutex);
  const bool is_full = open_count >= 2 * most;
  if (!is_full) full_since_ns = 0;
  if (is_full && full_since_ns == 0) full_since_ns = now_ns();
  const bool may = most == 0 || (phase != kStarting && (!is_full || now_ns() - full_since_ns > longest_ns));
  pthread_mutex_unlock(&mutex);
  return may;
}

/* Returns true if connections may be accepted. Clients wait in the listen queue until the ORB has noticed
 * enough connections that have ended. After half a second add() decides: the servant's own connection is in
 * that queue, too. The sleep is short, since the thread may have other work. */
static bool is_open(void) {
  static const int wait_ms = 1;
  if (may_accept()) return true;
  (void)poll(NULL, 0, wait_ms);
  return may_accept();
}

static void note_listener(int fd) {
  for (int i = 0; i < listener_count; ++i) {
    if (listeners[i] == fd) return;
  }
  if (listener_count < kMostListeners) listeners[listener_count++] = fd;
}

/* Replaces the C library's function for the ORB; declared like it. */
int accept(int fd, __SOCKADDR_ARG address, socklen_t* restrict size) {
  if (!is_open()) {
    errno = ECONNABORTED;
    return -1;
  }
  const int accepted = accept4(fd, address, size, 0);
  if (accepted < 0) return accepted;
  pthread_mutex_lock(&mutex);
  note_listener(fd);
  const bool kept = most == 0 || (phase == kServing && add(accepted));
  pthread_mutex_unlock(&mutex);
  if (kept) return accepted;
  (void)close(accepted);
  errno = ECONNABORTED;
  return -1;
}

/* Removes a connection and closes it in one step: no other thread can get its descriptor in between. */
static int close_here(int fd) {
  pthread_mutex_lock(&mutex);
  forget(fd);
  const int result = (int)syscall(SYS_close, fd);
  const int error = errno;
  pthread_mutex_unlock(&mutex);
  errno = error;
  return result;
}

static void* close_those_left(void* unused) {
  (void)unused;
  for (;;) {
    int fd = -1;
    const ssize_t size = syscall(SYS_read, to_close[0], &fd, sizeof(fd));
    if (size == (ssize_t)sizeof(fd)) {
      (void)close_here(fd);
    } else if (size >= 0 || errno != EINTR) {
      return NULL;
    }
  }
}

void corbot_connections_close_elsewhere(void) {
  pthread_t thread = 0;
  sigset_t all;
  sigset_t before;
  if (closer >= 0 || pipe2(to_close, O_CLOEXEC) != 0) return;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before); /* the thread takes no signal */
  if (pthread_create(&thread, NULL, close_those_left, NULL) == 0) {
    (void)pthread_detach(thread);
    closer = to_close[1];
  } else {
    (void)close(to_close[0]);
    (void)close(to_close[1]);
  }
  pthread_sigmask(SIG_SETMASK, &before, NULL);
}

/* Replaces the C library's function. Closing any descriptor that is no accepted connection takes no lock
 * here, so the caller may hold any lock. The pipe has room for all descriptors. */
int close(int fd) {
  if (fd < 0 || fd >= kDescriptors || entries[fd].number == 0) return (int)syscall(SYS_close, fd);
  const int to = closer;
  if (to < 0) return close_here(fd);
  if (atomic_exchange(&entries[fd].left, true)) {
    errno = EBADF; /* two threads close it */
    return -1;
  }
  return write(to, &fd, sizeof(fd)) == (ssize_t)sizeof(fd) ? 0 : close_here(fd);
}

void corbot_connections_pass(void) {
  pthread_mutex_lock(&mutex);
  pthread_mutex_unlock(&mutex);
}

corbot_connection corbot_connection_used(int fd) {
  corbot_connection connection = {fd, 0};
  if (fd < 0 || fd >= kDescriptors) return connection;
  pthread_mutex_lock(&mutex);
  if (entries[fd].number != 0) entries[fd].used_ns = now_ns();
  connection.number = entries[fd].number;
  pthread_mutex_unlock(&mutex);
  return connection;
}

bool corbot_connection_begin_call(corbot_connection connection) {
  if (connection.number == 0) return true; /* an unknown connection */
  pthread_mutex_lock(&mutex);
  Entry* entry = find(connection);
  const bool stays = entry != NULL && !entry->ending;
  if (stays) {
    ++entry->calls;
    entry->used_ns = now_ns();
  }
  pthread_mutex_unlock(&mutex);
  return stays;
}

void corbot_connection_end_call(corbot_connection connection) {
  pthread_mutex_lock(&mutex);
  Entry* entry = find(connection);
  if (entry != NULL) {
    --entry->calls;
    entry->used_ns = now_ns();
  }
  pthread_mutex_unlock(&mutex);
}

bool corbot_connection_lives(corbot_connection connection) {
  if (connection.number == 0) return true; /* an unknown connection */
  pthread_mutex_lock(&mutex);
  bool lives = find(connection) != NULL;
  if (lives) {
    struct pollfd polled = {connection.fd, POLLRDHUP, 0};
    lives = poll(&polled, 1, 0) == 0 || (polled.revents & (POLLRDHUP | POLLHUP | POLLERR | POLLNVAL)) == 0;
  }
  pthread_mutex_unlock(&mutex);
  return lives;
}

corbot_peer corbot_connection_peer(corbot_connection connection) {
  pthread_mutex_lock(&mutex);
  const Entry* entry = find(connection);
  const corbot_peer unknown = {AF_UNSPEC, 0};
  const corbot_peer peer = entry != NULL ? entry->peer : unknown;
  pthread_mutex_unlock(&mutex);
  return peer;
}

void corbot_connection_peer_text(corbot_connection connection, char out[CORBOT_PEER_TEXT]) {
  out[0] = '\0';
  pthread_mutex_lock(&mutex);
  if (find(connection) != NULL) peer_text_of(connection.fd, out);
  pthread_mutex_unlock(&mutex);
}

bool corbot_peer_equal(corbot_peer a, corbot_peer b) { return a.family == b.family && a.id == b.id; }
