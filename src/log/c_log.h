/* SPDX-License-Identifier: Apache-2.0
 *
 * The log of a program in C. */
#ifndef CORBOT_LOG_C_LOG_H
#define CORBOT_LOG_C_LOG_H

#ifdef __cplusplus
extern "C" {
#endif

/* Writes a line to standard error and never waits for a reader. A line without room is left out and counted.
 * Thread-safe, not real-time safe. */
void corbot_log_line(const char* line);

#ifdef __cplusplus
}
#endif
#endif /* CORBOT_LOG_C_LOG_H */
