/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/log.h"

#include <glib.h>
#include <stdarg.h>
#include <stdio.h>
#include <time.h>

#include "log/c_log.h"

enum { kLongestLine = 1024 };

static void write_line(const char* level, const char* text) {
  struct timespec now;
  struct tm local;
  char stamp[32];
  char line[kLongestLine + 128];
  (void)clock_gettime(CLOCK_REALTIME, &now);
  (void)localtime_r(&now.tv_sec, &local);
  (void)strftime(stamp, sizeof(stamp), "%Y-%m-%d %H:%M:%S", &local);
  (void)snprintf(line, sizeof(line), "[%s.%03ld] [corbot-servant-orbit2] [%s] %s", stamp,
                 now.tv_nsec / 1000000, level, text);
  corbot_log_line(line);
}

static void write_formatted(const char* level, const char* format, va_list arguments) {
  char text[kLongestLine];
  (void)vsnprintf(text, sizeof(text), format, arguments);
  write_line(level, text);
}

void log_info(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  write_formatted("info", format, arguments);
  va_end(arguments);
}

void log_warning(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  write_formatted("warning", format, arguments);
  va_end(arguments);
}

void log_error(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  write_formatted("error", format, arguments);
  va_end(arguments);
}

/* Logs a message of GLib. If the message is fatal, GLib ends the process after this returns. */
static void take_glib_message(const char* domain, GLogLevelFlags level, const char* message, void* unused) {
  (void)unused;
  const char* from = domain != NULL ? domain : "GLib";
  if (level & (G_LOG_LEVEL_ERROR | G_LOG_LEVEL_CRITICAL)) {
    log_error("%s: %s", from, message);
  } else if (level & G_LOG_LEVEL_WARNING) {
    log_warning("%s: %s", from, message);
  }
}

void log_start(void) { (void)g_log_set_default_handler(take_glib_message, NULL); }
