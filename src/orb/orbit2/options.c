/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/options.h"

#include <glib.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/un.h>

#include "orb/orbit2/ior.h"
#include "orb/orbit2/log.h"

enum { kUsageError = 2 };

static const char kUnsafeOption[] = "--i-know-orbit2-is-unsafe";

G_GNUC_NORETURN static void usage_error(const char* option, const char* text) {
  (void)fprintf(stderr, "corbot-servant-orbit2: %s%s%s\nRun with --help for more information.\n", option,
                *option != '\0' ? ": " : "", text);
  exit(kUsageError);
}

/* Removes the ORB's options from the command line. */
static int take_orb_options(int argc, char** argv, Options* out) {
  /* This program selects and checks the endpoint itself. */
  static const char* const ours[] = {"ORBIIOP", "ORBNetID", "ORBLocalOnly", "ORBNoUserRC", "ORBNoSystemRC"};
  int kept = 1;
  for (int i = 1; i < argc; ++i) {
    const char* word = argv[i] + strspn(argv[i], "-");
    if (word == argv[i] || strncmp(word, "ORB", 3) != 0) {
      argv[kept++] = argv[i];
      continue;
    }
    for (size_t k = 0; k < G_N_ELEMENTS(ours); ++k) {
      if (strncmp(word, ours[k], strlen(ours[k])) == 0) {
        usage_error(argv[i], "is set by --endpoint and --unix");
      }
    }
    if (out->orb_count == kMostOrbOptions) usage_error(argv[i], "more than 16 options for the ORB");
    out->orb[out->orb_count++] = argv[i];
  }
  argv[kept] = NULL;
  return kept;
}

static void check(const Options* options, int rest) {
  if (options->profile == NULL) usage_error("PROFILE", "is required");
  if (rest > 1) usage_error("PROFILE", "one only");
  if (options->naming != NULL) {
    char* ior = ior_from_reference("", options->naming);
    if (ior == NULL) usage_error("--naming", "write corbaloc::HOST:PORT/NameService, or an IOR");
    g_free(ior);
  }
  if (options->unix_path == NULL) return;
  if (options->endpoint.port != 0)
    usage_error("--unix", "excludes --endpoint: ORBit2 listens on one address");
  if (options->naming != NULL)
    usage_error("--unix", "excludes --naming: no other ORB can connect to such an address");
  if (*options->unix_path != '/') usage_error("--unix", "needs an absolute path");
  if (strlen(options->unix_path) >= sizeof(((struct sockaddr_un*)NULL)->sun_path)) {
    usage_error("--unix", "the path is too long for a Unix socket");
  }
}

void options_parse(int argc, char** argv, Options* out) {
  memset(out, 0, sizeof(*out));
  argc = take_orb_options(argc, argv, out);
  char* endpoint = NULL;
  gboolean unsafe = FALSE;
  const GOptionEntry entries[] = {
      {"name", 0, 0, G_OPTION_ARG_STRING, &out->name,
       "name of the robot and object key, instead of the profile's", "NAME"},
      {"endpoint", 0, 0, G_OPTION_ARG_STRING, &endpoint, "address to listen on, instead of the profile's",
       "HOST:PORT or [IPV6]:PORT"},
      {"unix", 0, 0, G_OPTION_ARG_FILENAME, &out->unix_path, "Unix socket to listen on, instead of TCP",
       "PATH"},
      {"naming", 0, 0, G_OPTION_ARG_STRING, &out->naming,
       "naming service, for example corbaloc::127.0.0.1:2809/NameService", "REFERENCE"},
      {"state-dir", 0, 0, G_OPTION_ARG_FILENAME, &out->state_directory,
       "where the last position is saved, instead of $CORBOT_STATE_DIR or ~/.local/state/corbot",
       "DIRECTORY"},
      {kUnsafeOption + 2, 0, 0, G_OPTION_ARG_NONE, &unsafe,
       "allow an address outside the loopback interface, though every client there can end this process",
       NULL},
      G_OPTION_ENTRY_NULL};
  GOptionContext* context = g_option_context_new("PROFILE");
  g_option_context_set_summary(context, "corbot's servant on ORBit2: serves a robot to CORBA clients");
  g_option_context_set_description(context, "Options that begin with --ORB go to ORBit2.");
  g_option_context_add_main_entries(context, entries, NULL);
  GError* error = NULL;
  const bool good = g_option_context_parse(context, &argc, &argv, &error);
  g_option_context_free(context);
  if (!good) usage_error("", error->message);
  out->unsafe = unsafe != FALSE;
  if (argc > 1) out->profile = argv[1];
  if (endpoint != NULL) {
    char why[CORBOT_WHY];
    if (!corbot_endpoint_parse(endpoint, &out->endpoint, why)) usage_error("--endpoint", why);
    g_free(endpoint);
  }
  check(out, argc - 1);
}

bool options_settle_endpoint(Options* options, const char* profile_host, int profile_port) {
  if (options->unix_path != NULL) return true;
  if (options->endpoint.port == 0) {
    (void)snprintf(options->endpoint.host, sizeof(options->endpoint.host), "%s", profile_host);
    options->endpoint.port = profile_port;
  }
  if (corbot_is_loopback(options->endpoint.host)) return true;
  if (options->unsafe) {
    log_warning("listening on %s: anyone who reaches it can move the robot, and crash this process",
                options->endpoint.host);
    return true;
  }
  log_error(
      "will not listen on %s: ORBit2 has no protection against a malformed request, which ends the process, "
      "and no encryption. Listen on 127.0.0.1 and tunnel (ssh -L), use corbot-servant (omniORB), or give %s",
      options->endpoint.host, kUnsafeOption);
  return false;
}

void options_free(Options* options) {
  g_free(options->name);
  g_free(options->unix_path);
  g_free(options->naming);
  g_free(options->state_directory);
}
