/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_LOG_H
#define CORBOT_ORBIT2_LOG_H

/* Writes lines to standard error in the format of the omniORB servant. Thread-safe. */

/* Also logs the messages of GLib and ORBit2 from now on. */
void log_start(void);
__attribute__((format(printf, 1, 2))) void log_info(const char* format, ...);
__attribute__((format(printf, 1, 2))) void log_warning(const char* format, ...);
__attribute__((format(printf, 1, 2))) void log_error(const char* format, ...);

#endif /* CORBOT_ORBIT2_LOG_H */
