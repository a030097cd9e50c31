/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include "net/giop_probe.h"

#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "net/connections.h"

enum { kHeader = 12, kLocateRequest = 3, kLocateReply = 4, kObjectHere = 1, kLargestReply = 4096 };

/* Returns 1 when `events` occur, 0 after the time-out. Only the time in which this process ran and waited
 * counts. After a suspend of the machine the loop looks once more, so it sees events that occurred meanwhile.
 */
static int wait_for(int fd, short events, int* left_ms) {
  enum { kLookMs = 50 };
  for (;;) {
    const int look_ms = *left_ms < kLookMs ? *left_ms : kLookMs;
    struct pollfd entry = {fd, events, 0};
    const int ready = poll(&entry, 1, look_ms);
    if (ready > 0) return 1;
    if (ready < 0 && errno != EINTR) return 0;
    *left_ms -= look_ms;
    if (*left_ms <= 0) return 0;
  }
}

/* Binds to a separate port, which the connections know before the connection arrives. */
static void bind_own(int fd, int family) {
  struct sockaddr_storage address;
  memset(&address, 0, sizeof(address));
  address.ss_family = (sa_family_t)family;
  socklen_t size = family == AF_INET ? sizeof(struct sockaddr_in) : sizeof(struct sockaddr_in6);
  if (bind(fd, (const struct sockaddr*)&address, size) != 0 ||
      getsockname(fd, (struct sockaddr*)&address, &size) != 0)
    return;
  corbot_connections_expect_own(ntohs(family == AF_INET ? ((const struct sockaddr_in*)&address)->sin_port
                                                        : ((const struct sockaddr_in6*)&address)->sin6_port));
}

static int finish_connect(int fd, const struct sockaddr* address, socklen_t size, int* left_ms) {
  if (connect(fd, address, size) == 0) return 1;
  if (errno != EINPROGRESS || !wait_for(fd, POLLOUT, left_ms)) return 0;
  int error = 0;
  socklen_t length = sizeof(error);
  return getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &length) == 0 && error == 0;
}

static int connect_to(int family, const struct sockaddr* address, socklen_t size, int* left_ms) {
  const int fd = socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return -1;
  if (family != AF_UNIX) bind_own(fd, family);
  if (finish_connect(fd, address, size, left_ms)) return fd;
  close(fd);
  return -1;
}

static int connect_tcp(const corbot_giop_probe* probe, int* left_ms) {
  struct addrinfo hints;
  memset(&hints, 0, sizeof(hints));
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV;
  struct addrinfo* found = NULL;
  if (getaddrinfo(probe->host, probe->port, &hints, &found) != 0) return -1;
  int fd = -1;
  for (const struct addrinfo* entry = found; entry != NULL && fd < 0; entry = entry->ai_next)
    fd = connect_to(entry->ai_family, entry->ai_addr, entry->ai_addrlen, left_ms);
  freeaddrinfo(found);
  const int on = 1;
  if (fd >= 0) (void)setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  return fd;
}

static int connect_unix(const corbot_giop_probe* probe, int* left_ms) {
  struct sockaddr_un address;
  memset(&address, 0, sizeof(address));
  address.sun_family = AF_UNIX;
  memcpy(address.sun_path, probe->unix_path, sizeof(address.sun_path));
  return connect_to(AF_UNIX, (const struct sockaddr*)&address, sizeof(address), left_ms);
}

static int send_all(int fd, const unsigned char* bytes, size_t size, int* left_ms) {
  while (size > 0) {
    const ssize_t sent = send(fd, bytes, size, MSG_NOSIGNAL);
    if (sent > 0) {
      bytes += sent;
      size -= (size_t)sent;
    } else if (sent < 0 && errno != EINTR && (errno != EAGAIN || !wait_for(fd, POLLOUT, left_ms))) {
      return 0;
    }
  }
  return 1;
}

static int receive_all(int fd, unsigned char* bytes, size_t size, int* left_ms) {
  while (size > 0) {
    if (!wait_for(fd, POLLIN, left_ms)) return 0;
    const ssize_t got = recv(fd, bytes, size, 0);
    if (got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN)) return 0;
    if (got < 0) continue;
    bytes += got;
    size -= (size_t)got;
  }
  return 1;
}

static void put_big_endian(unsigned char* at, uint32_t value) {
  for (int i = 0; i < 4; ++i) at[i] = (unsigned char)(value >> (24 - 8 * i));
}

/* Returns the integer in the sender's byte order. */
static uint32_t get(const unsigned char* at, int little_endian) {
  uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value |= (uint32_t)at[i] << (little_endian ? 8 * i : 24 - 8 * i);
  return value;
}

static int locate(corbot_giop_probe* probe, int* left_ms) {
  unsigned char request[kHeader + 8 + sizeof(probe->key)] = {'G', 'I', 'O', 'P', 1, 0, 0, kLocateRequest};
  const uint32_t key_size = (uint32_t)strlen(probe->key);
  const uint32_t number = ++probe->request;
  put_big_endian(request + 8, 8 + key_size);
  put_big_endian(request + kHeader, number);
  put_big_endian(request + kHeader + 4, key_size);
  memcpy(request + kHeader + 8, probe->key, key_size);
  if (!send_all(probe->fd, request, kHeader + 8 + key_size, left_ms)) return 0;
  unsigned char header[kHeader];
  unsigned char body[kLargestReply];
  if (!receive_all(probe->fd, header, sizeof(header), left_ms)) return 0;
  const int little_endian = header[6] & 1;
  const uint32_t size = get(header + 8, little_endian);
  if (memcmp(header, "GIOP", 4) != 0 || header[7] != kLocateReply || size < 8 || size > sizeof(body))
    return 0;
  if (!receive_all(probe->fd, body, size, left_ms)) return 0;
  probe->is_here = get(body + 4, little_endian) == kObjectHere;
  return get(body, little_endian) == number;
}

void corbot_giop_probe_init(corbot_giop_probe* probe, const char* host, int port, const char* unix_path,
                            const char* key) {
  memset(probe, 0, sizeof(*probe));
  probe->fd = -1;
  (void)snprintf(probe->host, sizeof(probe->host), "%s", host != NULL ? host : "");
  (void)snprintf(probe->port, sizeof(probe->port), "%d", port);
  (void)snprintf(probe->unix_path, sizeof(probe->unix_path), "%s", unix_path != NULL ? unix_path : "");
  (void)snprintf(probe->key, sizeof(probe->key), "%s", key);
}

int corbot_giop_probe_answers(corbot_giop_probe* probe, int timeout_ms) {
  int left_ms = timeout_ms;
  corbot_connections_pass(); /* the probe keeps its connection, so no accept() of its own takes that lock */
  /* Tries once more on a new connection: the ORB closes connections that it does not need. */
  for (int attempt = 0; attempt < 2; ++attempt) {
    const int is_new = probe->fd < 0;
    if (is_new)
      probe->fd = probe->unix_path[0] != '\0' ? connect_unix(probe, &left_ms) : connect_tcp(probe, &left_ms);
    if (probe->fd < 0) return 0;
    if (locate(probe, &left_ms)) return 1;
    corbot_giop_probe_close(probe);
    if (is_new) return 0;
  }
  return 0;
}

void corbot_giop_probe_close(corbot_giop_probe* probe) {
  if (probe->fd >= 0) close(probe->fd);
  probe->fd = -1;
}
