/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CORBOT_CLIENT_ORBIT2_VALUES_H
#define CORBOT_CLIENT_ORBIT2_VALUES_H

#include <glib.h>
#include <orbit/orbit.h>

/* Values in memory by their type information, and results as text. */

static CORBA_ORB orb;

static CORBA_TypeCode resolved(CORBA_TypeCode tc) {
  while (tc->kind == CORBA_tk_alias) tc = tc->subtypes[0];
  return tc;
}

typedef struct Layout {
  size_t size;
  size_t alignment;
} Layout;

static size_t aligned(size_t offset, size_t alignment) {
  return (offset + alignment - 1) / alignment * alignment;
}

static Layout layout_of(CORBA_TypeCode tc) {
  tc = resolved(tc);
  switch (tc->kind) {
    case CORBA_tk_boolean:
      return (Layout){1, 1};
    case CORBA_tk_long:
    case CORBA_tk_ulong:
    case CORBA_tk_enum:
      return (Layout){4, 4};
    case CORBA_tk_sequence:
      return (Layout){sizeof(CORBA_sequence_CORBA_double), 8};
    case CORBA_tk_struct:
    case CORBA_tk_except: {
      Layout all = {0, 1};
      for (CORBA_unsigned_long i = 0; i < tc->sub_parts; ++i) {
        const Layout member = layout_of(tc->subtypes[i]);
        all.size = aligned(all.size, member.alignment) + member.size;
        all.alignment = MAX(all.alignment, member.alignment);
      }
      all.size = aligned(all.size, all.alignment);
      return all;
    }
    default: /* double, unsigned long long, string */
      return (Layout){8, 8};
  }
}

static void write_value(GString* out, CORBA_TypeCode tc, const char* at) {
  tc = resolved(tc);
  switch (tc->kind) {
    case CORBA_tk_double:
      g_string_append_printf(out, "%.17g", *(const double*)at);
      return;
    case CORBA_tk_long:
      g_string_append_printf(out, "%d", *(const gint32*)at);
      return;
    case CORBA_tk_ulong:
      g_string_append_printf(out, "%u", *(const guint32*)at);
      return;
    case CORBA_tk_ulonglong:
      g_string_append_printf(out, "%" G_GUINT64_FORMAT, *(const guint64*)at);
      return;
    case CORBA_tk_boolean:
      g_string_append(out, *(const CORBA_boolean*)at ? "true" : "false");
      return;
    case CORBA_tk_enum:
      g_string_append(out, tc->subnames[*(const guint32*)at]);
      return;
    case CORBA_tk_string: {
      char* escaped = g_strescape(*(char* const*)at, "\n\t");
      g_string_append_printf(out, "\"%s\"", escaped);
      g_free(escaped);
      return;
    }
    case CORBA_tk_objref: {
      CORBA_Environment ev;
      CORBA_exception_init(&ev);
      CORBA_char* reference = CORBA_ORB_object_to_string(orb, *(const CORBA_Object*)at, &ev);
      g_string_append(out, reference != NULL ? reference : "");
      CORBA_free(reference);
      CORBA_exception_free(&ev);
      return;
    }
    case CORBA_tk_sequence: {
      const CORBA_sequence_CORBA_double* sequence = (const void*)at;
      const char* element = (const char*)sequence->_buffer;
      g_string_append_c(out, '[');
      for (CORBA_unsigned_long i = 0; i < sequence->_length; ++i) {
        if (i > 0) g_string_append_c(out, ' ');
        write_value(out, tc->subtypes[0], element + i * layout_of(tc->subtypes[0]).size);
      }
      g_string_append_c(out, ']');
      return;
    }
    default: { /* struct, exception */
      size_t offset = 0;
      g_string_append_c(out, '{');
      for (CORBA_unsigned_long i = 0; i < tc->sub_parts; ++i) {
        const Layout member = layout_of(tc->subtypes[i]);
        offset = aligned(offset, member.alignment);
        g_string_append_printf(out, "%s%s=", i > 0 ? " " : "", tc->subnames[i]);
        write_value(out, tc->subtypes[i], at + offset);
        offset += member.size;
      }
      g_string_append_c(out, '}');
    }
  }
}

#endif /* CORBOT_CLIENT_ORBIT2_VALUES_H */
