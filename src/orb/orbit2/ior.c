/* SPDX-License-Identifier: Apache-2.0 */
#include "orb/orbit2/ior.h"

#include <glib.h>
#include <stdbool.h>
#include <string.h>

#include "net/endpoint.h"

enum { kIiopPort = 2809, kIiopMinor = 2, kInternetIop = 0 };
/* ORBit2's own profile type, for Unix sockets. */
static const guint32 kOrbitSpecific = 0xbadfaeca;

/* Begins a CDR encapsulation: alignment counts from its start, which contains the byte order. */
static GByteArray* encapsulation(void) {
  const guint8 little_endian = 1;
  return g_byte_array_append(g_byte_array_new(), &little_endian, 1);
}

static void put_octet(GByteArray* out, guint8 value) { g_byte_array_append(out, &value, 1); }

static void align(GByteArray* out, guint to) {
  while (out->len % to != 0) put_octet(out, 0);
}

static void put_u16(GByteArray* out, guint16 value) {
  const guint16 raw = GUINT16_TO_LE(value);
  align(out, sizeof(raw));
  g_byte_array_append(out, (const guint8*)&raw, sizeof(raw));
}

static void put_u32(GByteArray* out, guint32 value) {
  const guint32 raw = GUINT32_TO_LE(value);
  align(out, sizeof(raw));
  g_byte_array_append(out, (const guint8*)&raw, sizeof(raw));
}

static void put_octets(GByteArray* out, const void* bytes, guint length) {
  put_u32(out, length);
  g_byte_array_append(out, bytes, length);
}

static void put_text(GByteArray* out, const char* text) { put_octets(out, text, (guint)strlen(text) + 1); }

/* Returns an IOR with one profile. */
static char* ior_text(const char* type, guint32 tag, const GByteArray* profile) {
  GByteArray* all = encapsulation();
  put_text(all, type);
  put_u32(all, 1);
  put_u32(all, tag);
  put_octets(all, profile->data, profile->len);
  GString* text = g_string_new("IOR:");
  for (guint i = 0; i < all->len; ++i) g_string_append_printf(text, "%02x", all->data[i]);
  g_byte_array_unref(all);
  return g_string_free(text, FALSE);
}

char* ior_make(const char* type, const char* host, int port, const char* key, unsigned key_length) {
  GByteArray* profile = encapsulation();
  put_octet(profile, 1);
  put_octet(profile, kIiopMinor);
  put_text(profile, host);
  put_u16(profile, (guint16)port);
  put_octets(profile, key, key_length);
  put_u32(profile, 0); /* number of components */
  char* text = ior_text(type, kInternetIop, profile);
  g_byte_array_unref(profile);
  return text;
}

char* ior_make_unix(const char* type, const char* path, const char* key, unsigned key_length) {
  GByteArray* profile = encapsulation();
  put_octet(profile, 1);
  put_octet(profile, kIiopMinor);
  put_text(profile, path);
  put_u16(profile, 0); /* no port of IPv6 */
  put_octets(profile, key, key_length);
  char* text = ior_text(type, kOrbitSpecific, profile);
  g_byte_array_unref(profile);
  return text;
}

/* Returns true if `all` has a sequence of octets at `at` that ends with these bytes. Its length precedes it.
 */
static bool is_key(const GByteArray* all, guint at, const void* end, guint end_length, guint* length) {
  if (at + sizeof(*length) > all->len) return false;
  memcpy(length, all->data + at, sizeof(*length)); /* our own reference, in our own byte order */
  const guint begin = at + (guint)sizeof(*length);
  return *length > end_length && *length <= all->len - begin &&
         memcmp(all->data + begin + *length - end_length, end, end_length) == 0;
}

GByteArray* ior_key(const char* ior, const void* end, unsigned end_length) {
  if (!g_str_has_prefix(ior, "IOR:")) return NULL;
  GByteArray* all = g_byte_array_new();
  for (const char* hex = ior + strlen("IOR:"); g_ascii_isxdigit(hex[0]) && g_ascii_isxdigit(hex[1]);
       hex += 2) {
    put_octet(all, (guint8)(g_ascii_xdigit_value(hex[0]) * 16 + g_ascii_xdigit_value(hex[1])));
  }
  GByteArray* key = NULL;
  guint length = 0;
  for (guint at = 0; at < all->len; ++at) {
    if (!is_key(all, at, end, end_length, &length)) continue;
    /* A profile may end with its key, so the innermost sequence is the key. */
    if (key != NULL) g_byte_array_unref(key);
    key = g_byte_array_append(g_byte_array_new(), all->data + at + sizeof(length), length);
  }
  g_byte_array_unref(all);
  return key;
}

/* Parses "HOST[:PORT]". */
static bool parse_address(const char* text, corbot_endpoint* out) {
  char why[CORBOT_WHY];
  if (strchr(text, ':') != NULL) return corbot_endpoint_parse(text, out, why);
  out->port = kIiopPort;
  return *text != '\0' && g_strlcpy(out->host, text, sizeof(out->host)) < sizeof(out->host);
}

char* ior_from_reference(const char* type, const char* reference) {
  if (g_str_has_prefix(reference, "IOR:")) return g_strdup(reference);
  const char* at = NULL;
  if (g_str_has_prefix(reference, "corbaloc::")) at = reference + strlen("corbaloc::");
  if (g_str_has_prefix(reference, "corbaloc:iiop:")) at = reference + strlen("corbaloc:iiop:");
  const char* slash = at != NULL ? strchr(at, '/') : NULL;
  if (slash == NULL) return NULL;
  char* address = g_strndup(at, strcspn(at, ",/"));
  const char* version = strchr(address, '@');
  char* key = g_uri_unescape_string(slash + 1, NULL);
  corbot_endpoint endpoint;
  char* made = NULL;
  if (key != NULL && *key != '\0' && parse_address(version != NULL ? version + 1 : address, &endpoint)) {
    made = ior_make(type, endpoint.host, endpoint.port, key, (unsigned)strlen(key));
  }
  g_free(key);
  g_free(address);
  return made;
}
