/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_OPTIONS_H
#define CORBOT_ORBIT2_OPTIONS_H

#include <stdbool.h>

#include "net/endpoint.h"

enum { kMostOrbOptions = 16 };

/* The servant's command line: the omniORB servant's and one additional option. */
typedef struct Options {
  char* profile;
  char* name;                       /* NULL: the profile's */
  corbot_endpoint endpoint;         /* port 0: the profile's */
  char* unix_path;                  /* NULL: TCP; ORBit2 listens on one address, so it replaces TCP */
  char* naming;                     /* corbaloc of a naming service; NULL: none */
  char* state_directory;            /* directory of the last position; NULL: the default one */
  bool unsafe;                      /* may listen on other interfaces than the loopback */
  const char* orb[kMostOrbOptions]; /* --ORB... options, passed on */
  int orb_count;
} Options;

/* Parses the command line. Prints help or a fault and exits if necessary. */
void options_parse(int argc, char** argv, Options* out);
/* Fills in the endpoint from the profile if the command line gives none. Refuses an address that is not of
 * the loopback interface (message, false), unless the option states that ORBit2's unsafety is known. */
bool options_settle_endpoint(Options* options, const char* profile_host, int profile_port);
void options_free(Options* options);

#endif /* CORBOT_ORBIT2_OPTIONS_H */
