/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_ORBIT2_IOR_H
#define CORBOT_ORBIT2_IOR_H

#include <glib.h>

/* References as "IOR:..." texts. ORBit2 reads a corbaloc by way of 16 GiB of memory, which ends the process
 * on a machine that has less, and leaks a little each time; so it never gets one. */

/* The object `key` at host:port, over IIOP 1.2. `type`: repository id. To be freed with g_free. */
char* ior_make(const char* type, const char* host, int port, const char* key, unsigned key_length);

/* The same on a Unix socket, which clients on ORBit2 on this machine can reach. */
char* ior_make_unix(const char* type, const char* path, const char* key, unsigned key_length);

/* The object key in a reference, of whatever transport, that ends with these bytes; NULL when there is none.
 * To be released with g_byte_array_unref. */
GByteArray* ior_key(const char* ior, const void* end, unsigned end_length);

/* The same for a corbaloc ("corbaloc:[iiop]:[VERSION@]HOST[:PORT]/KEY", of several addresses the first); an
 * IOR is returned as it is. NULL for anything else. To be freed with g_free. */
char* ior_from_reference(const char* type, const char* reference);

#endif /* CORBOT_ORBIT2_IOR_H */
