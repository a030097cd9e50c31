/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_OPTIONS_H
#define CORBOT_ORBIT2_OPTIONS_H

#include <stdbool.h>

#include "net/endpoint.h"

enum { kMostOrbOptions = 16 };

/* The servant's command line; the same as the omniORB servant's, and one option more. */
typedef struct Options {
  char* profile;
  char* name;               /* NULL: the profile's */
  corbot_endpoint endpoint; /* port 0: the profile's */
  char* unix_path;          /* NULL: TCP. ORBit2 listens on one address: a Unix socket takes TCP's place */
  char* naming;             /* corbaloc of a naming service; NULL: none */
  char* state_directory;    /* of the last position; NULL: the default one */
  bool unsafe;              /* may listen elsewhere than on the loopback interface */
  const char* orb[kMostOrbOptions]; /* --ORB... options, handed through */
  int orb_count;
} Options;

/* Parses. Prints help or what is wrong and leaves the process when the command line asks for that. */
void options_parse(int argc, char** argv, Options* out);
/* Fills in from the profile what the command line left open, and refuses (message, false) an address that is
 * not of the loopback interface, unless the option says that ORBit2's unsafety is known. */
bool options_settle_endpoint(Options* options, const char* profile_host, int profile_port);
void options_free(Options* options);

#endif /* CORBOT_ORBIT2_OPTIONS_H */
