/* SPDX-License-Identifier: Apache-2.0
 *
 * Linked into the servant on omniORB under the address sanitizer. It lists the leaks of omniORB itself, which
 * no program that uses omniORB can fix. */

const char* __lsan_default_suppressions(void);
const char* __asan_default_options(void);

const char* __lsan_default_suppressions(void) {
  /* The server's side of a connection that is being closed for an invalid message, when the ORB ends. */
  return "leak:omni::giopStrand::acquireServer\n";
}

const char* __asan_default_options(void) { return "print_suppressions=0"; }
