/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include "net/endpoint.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { kHighestPort = 65535 };

/* Puts the host without brackets in *out. Returns the beginning of the port, or NULL if the text has another
 * form. */
static const char* split(const char* text, corbot_endpoint* out) {
  const bool bracketed = text[0] == '[';
  const char* host = bracketed ? text + 1 : text;
  const char* end = bracketed ? strchr(host, ']') : strrchr(text, ':');
  if (end == NULL || (bracketed && end[1] != ':')) return NULL;
  const size_t length = (size_t)(end - host);
  if (length == 0 || length >= CORBOT_HOST) return NULL;
  memcpy(out->host, host, length);
  out->host[length] = '\0';
  /* With more than one colon the host is an IPv6 address without its brackets. */
  if (bracketed != (strchr(out->host, ':') != NULL)) return NULL;
  if (bracketed && !corbot_is_ipv6(out->host)) return NULL;
  return bracketed ? end + 2 : end + 1;
}

static bool is_one_address(const char* host, char why[CORBOT_WHY]) {
  if (!corbot_is_wildcard(host)) return true;
  (void)snprintf(why, CORBOT_WHY,
                 "'%.100s' means all addresses of this machine: name the one by which clients reach it",
                 host);
  return false;
}

bool corbot_endpoint_parse(const char* text, corbot_endpoint* out, char why[CORBOT_WHY]) {
  const char* digits = split(text, out);
  long port = 0;
  if (digits != NULL && digits[0] >= '0' && digits[0] <= '9') {
    char* end = NULL;
    port = strtol(digits, &end, 10);
    if (*end != '\0') port = 0;
  }
  if (port < 1 || port > kHighestPort) {
    (void)snprintf(why, CORBOT_WHY, "'%.100s' is not HOST:PORT, or [IPV6]:PORT, with a port from 1 to 65535",
                   text);
    return false;
  }
  out->port = (int)port;
  return is_one_address(out->host, why);
}

void corbot_endpoint_text(const char* host, int port, char* out, size_t size) {
  (void)snprintf(out, size, strchr(host, ':') != NULL ? "[%s]:%d" : "%s:%d", host, port);
}

bool corbot_is_wildcard(const char* host) {
  struct in_addr ipv4;
  struct in6_addr ipv6;
  if (host[0] == '\0' || strcmp(host, "*") == 0) return true;
  if (inet_aton(host, &ipv4) != 0) return ipv4.s_addr == htonl(INADDR_ANY);
  if (inet_pton(AF_INET6, host, &ipv6) != 1) return false;
  if (IN6_IS_ADDR_UNSPECIFIED(&ipv6)) return true;
  const uint32_t zero = 0;
  return IN6_IS_ADDR_V4MAPPED(&ipv6) && memcmp(&ipv6.s6_addr[12], &zero, sizeof(zero)) == 0;
}

bool corbot_is_ipv6(const char* host) {
  struct in6_addr address;
  return inet_pton(AF_INET6, host, &address) == 1;
}

bool corbot_is_loopback(const char* host) {
  struct in_addr ipv4;
  struct in6_addr ipv6;
  if (strcmp(host, "localhost") == 0) return true;
  if (inet_aton(host, &ipv4) != 0) return (ntohl(ipv4.s_addr) >> 24) == IN_LOOPBACKNET;
  return inet_pton(AF_INET6, host, &ipv6) == 1 && IN6_IS_ADDR_LOOPBACK(&ipv6);
}

static bool resolve(const char* host, int port, struct sockaddr_storage* out, socklen_t* size,
                    char why[CORBOT_WHY]) {
  char service[8];
  (void)snprintf(service, sizeof(service), "%d", port);
  struct addrinfo hints = {.ai_family = corbot_is_ipv6(host) ? AF_INET6 : AF_INET,
                           .ai_socktype = SOCK_STREAM};
  struct addrinfo* found = NULL;
  const int error = getaddrinfo(host, service, &hints, &found);
  if (error != 0) {
    (void)snprintf(why, CORBOT_WHY, "'%s' is not a host of this machine: %s", host, gai_strerror(error));
    return false;
  }
  memset(out, 0, sizeof(*out));
  memcpy(out, found->ai_addr, found->ai_addrlen);
  *size = found->ai_addrlen;
  freeaddrinfo(found);
  return true;
}

/* The port is at the same offset in both families' addresses. */
static int port_of(const struct sockaddr_storage* address) {
  struct sockaddr_in ipv4 = {0};
  memcpy(&ipv4, address, sizeof(ipv4));
  return ntohs(ipv4.sin_port);
}

int corbot_listen(const char* host, int port, int* bound_port, char why[CORBOT_WHY]) {
  struct sockaddr_storage address = {0};
  socklen_t size = 0;
  if (!is_one_address(host, why) || !resolve(host, port, &address, &size, why)) return -1;
  const int fd = socket(address.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  /* SO_REUSEADDR like the ORBs: TIME_WAIT does not block it. */
  if (fd >= 0 && setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on)) == 0 &&
      bind(fd, (struct sockaddr*)&address, size) == 0 && listen(fd, 1) == 0 &&
      getsockname(fd, (struct sockaddr*)&address, &size) == 0) {
    *bound_port = port_of(&address);
    return fd;
  }
  const int error = errno;
  if (fd >= 0) close(fd);
  if (error == EADDRINUSE) {
    (void)snprintf(why, CORBOT_WHY, "port %d on %s is in use by another program", port, host);
  } else if (error == EADDRNOTAVAIL) {
    (void)snprintf(why, CORBOT_WHY, "'%s' is not an address of this machine", host);
  } else {
    char text[CORBOT_HOST + 16];
    corbot_endpoint_text(host, port, text, sizeof(text));
    (void)snprintf(why, CORBOT_WHY, "cannot listen on %.280s: %s", text, strerror(error));
  }
  return -1;
}

static bool listens_on(int fd, const struct sockaddr_storage* wanted) {
  int listening = 0;
  socklen_t size = sizeof(listening);
  if (getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &listening, &size) != 0 || listening == 0) return false;
  struct sockaddr_storage address = {0};
  size = sizeof(address);
  if (getsockname(fd, (struct sockaddr*)&address, &size) != 0 || address.ss_family != wanted->ss_family ||
      port_of(&address) != port_of(wanted)) {
    return false;
  }
  if (address.ss_family == AF_INET6) {
    const struct in6_addr* here = &((const struct sockaddr_in6*)&address)->sin6_addr;
    return IN6_IS_ADDR_UNSPECIFIED(here) ||
           IN6_ARE_ADDR_EQUAL(here, &((const struct sockaddr_in6*)wanted)->sin6_addr);
  }
  struct sockaddr_in here;
  struct sockaddr_in there;
  memcpy(&here, &address, sizeof(here));
  memcpy(&there, wanted, sizeof(there));
  return here.sin_addr.s_addr == INADDR_ANY || here.sin_addr.s_addr == there.sin_addr.s_addr;
}

int corbot_listening_socket(const char* host, int port) {
  struct sockaddr_storage wanted = {0};
  socklen_t size = 0;
  char why[CORBOT_WHY];
  if (!resolve(host, port, &wanted, &size, why)) return -1;
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
