/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include "net/endpoint.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { kHighestPort = 65535 };

bool corbot_endpoint_parse(const char* text, corbot_endpoint* out, char why[CORBOT_WHY]) {
  const char* colon = strrchr(text, ':');
  const size_t host_length = colon == NULL ? 0 : (size_t)(colon - text);
  long port = 0;
  if (host_length > 0 && host_length < CORBOT_HOST && colon[1] >= '0' && colon[1] <= '9') {
    char* end = NULL;
    port = strtol(colon + 1, &end, 10);
    if (*end != '\0') port = 0;
  }
  if (port < 1 || port > kHighestPort) {
    (void)snprintf(why, CORBOT_WHY, "'%.100s' is not HOST:PORT with a port from 1 to 65535", text);
    return false;
  }
  memcpy(out->host, text, host_length);
  out->host[host_length] = '\0';
  out->port = (int)port;
  if (strcmp(out->host, "0.0.0.0") == 0 || strcmp(out->host, "*") == 0) {
    (void)snprintf(why, CORBOT_WHY,
                   "name one host or address by which clients reach this machine, not all of them");
    return false;
  }
  return true;
}

bool corbot_is_loopback(const char* host) {
  struct in_addr address;
  if (strcmp(host, "localhost") == 0) return true;
  return inet_pton(AF_INET, host, &address) == 1 && (ntohl(address.s_addr) >> 24) == IN_LOOPBACKNET;
}

static bool resolve(const char* host, int port, struct sockaddr_in* out, char why[CORBOT_WHY]) {
  char service[8];
  (void)snprintf(service, sizeof(service), "%d", port);
  struct addrinfo hints = {.ai_family = AF_INET, .ai_socktype = SOCK_STREAM};
  struct addrinfo* found = NULL;
  const int error = getaddrinfo(host, service, &hints, &found);
  if (error != 0) {
    (void)snprintf(why, CORBOT_WHY, "'%s' is not a host of this machine: %s", host, gai_strerror(error));
    return false;
  }
  memcpy(out, found->ai_addr, sizeof(*out));
  freeaddrinfo(found);
  return true;
}

int corbot_listen(const char* host, int port, int* bound_port, char why[CORBOT_WHY]) {
  struct sockaddr_in address;
  if (!resolve(host, port, &address, why)) return -1;
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  socklen_t size = sizeof(address);
  /* SO_REUSEADDR as the ORBs do: not held up by TIME_WAIT. */
  if (fd >= 0 && setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on)) == 0 &&
      bind(fd, (struct sockaddr*)&address, size) == 0 && listen(fd, 1) == 0 &&
      getsockname(fd, (struct sockaddr*)&address, &size) == 0) {
    *bound_port = ntohs(address.sin_port);
    return fd;
  }
  const int error = errno;
  if (fd >= 0) close(fd);
  if (error == EADDRINUSE) {
    (void)snprintf(why, CORBOT_WHY, "port %d on %s is in use by another program", port, host);
  } else if (error == EADDRNOTAVAIL) {
    (void)snprintf(why, CORBOT_WHY, "'%s' is not an address of this machine", host);
  } else {
    (void)snprintf(why, CORBOT_WHY, "cannot listen on %s:%d: %s", host, port, strerror(error));
  }
  return -1;
}

static bool listens_on(int fd, const struct sockaddr_in* wanted) {
  int listening = 0;
  socklen_t size = sizeof(listening);
  if (getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &listening, &size) != 0 || listening == 0) return false;
  struct sockaddr_in address = {0};
  size = sizeof(address);
  return getsockname(fd, (struct sockaddr*)&address, &size) == 0 && address.sin_family == AF_INET &&
         address.sin_port == wanted->sin_port &&
         (address.sin_addr.s_addr == wanted->sin_addr.s_addr || address.sin_addr.s_addr == INADDR_ANY);
}

int corbot_listening_socket(const char* host, int port) {
  struct sockaddr_in wanted;
  char why[CORBOT_WHY];
  if (!resolve(host, port, &wanted, why)) return -1;
  DIR* directory = opendir("/proc/self/fd");
  if (directory == NULL) return -1;
  int found = -1;
  const struct dirent* entry = NULL;
  while (found < 0 && (entry = readdir(directory)) != NULL) {
    if (entry->d_name[0] == '.') continue;
    const int fd = (int)strtol(entry->d_name, NULL, 10);
    if (listens_on(fd, &wanted)) found = fd;
  }
  closedir(directory);
  return found;
}
