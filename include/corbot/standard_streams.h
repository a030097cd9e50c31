/* SPDX-License-Identifier: Apache-2.0 */
#pragma once

#include <fcntl.h>
#include <unistd.h>

/* The source of a program's main includes this header, so that each standard stream that is closed keeps its
 * number. Otherwise the next descriptor, such as that of a segment, would get the number, and a line of the
 * log would go there. Reading or writing such a stream still fails. */
static inline void corbot_keep_standard_streams(void) {
  for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
    const int mode = stream == STDIN_FILENO ? O_WRONLY : O_RDONLY; /* the wrong one */
    if (fcntl(stream, F_GETFD) < 0) (void)open("/dev/null", mode); /* gets the lowest number that is free */
  }
}

/* The loader calls this before the initialisers of the libraries. Those of omniORB open pipes. */
__attribute__((section(".preinit_array"),
               used)) static void (*const kCorbotBeforeLibraries)(void) = corbot_keep_standard_streams;
