/* SPDX-License-Identifier: Apache-2.0
 *
 * Linked into programs on ORBit2 under the address sanitizer: what ORBit2 itself leaks, and no program that
 * uses it can fix, and what its threads have, which live until the process ends. */

const char* __lsan_default_suppressions(void);
const char* __asan_default_options(void);

const char* __lsan_default_suppressions(void) {
  /* The request for an object that it does not know and the reply that forwards a client; the key of every
   * corbaloc that is read. OpenSSL's list of errors of a thread, which only the end of the thread frees. */
  return "leak:giop_recv_buffer_use_buf\n"
         "leak:corbaloc_profile_iiop\n"
         "leak:ERR_set_mark\n";
}

/* The quick look at the stack does not reach those functions. */
const char* __asan_default_options(void) { return "fast_unwind_on_malloc=0:print_suppressions=0"; }
