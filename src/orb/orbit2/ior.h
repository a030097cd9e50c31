/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_IOR_H
#define CORBOT_ORBIT2_IOR_H

#include <glib.h>

/* Makes references as "IOR:..." texts. ORBit2 maps 16 GiB of memory to read a corbaloc, which ends the
 * process on a machine with less. It also leaks a little each time. It therefore never gets a corbaloc. */

/* Returns a reference to the object `key` at host:port, over IIOP 1.2. `type`: repository id. To be freed
 * with g_free. */
char* ior_make(const char* type, const char* host, int port, const char* key, unsigned key_length);

/* Does the same for a Unix socket, which ORBit2 clients on this machine can reach. */
char* ior_make_unix(const char* type, const char* path, const char* key, unsigned key_length);

/* Returns the object key in a reference of any transport that ends with these bytes, or NULL. To be released
 * with g_byte_array_unref. */
GByteArray* ior_key(const char* ior, const void* end, unsigned end_length);

/* Converts a corbaloc ("corbaloc:[iiop]:[VERSION@]HOST[:PORT]/KEY", the first of several addresses). Returns
 * an IOR unchanged, and NULL for any other text. To be freed with g_free. `type`: repository id. */
char* ior_from_reference(const char* type, const char* reference);

#endif /* CORBOT_ORBIT2_IOR_H */
