/* SPDX-License-Identifier: Apache-2.0
 *
 * Test client of Corbot::Arm over ORBit2: reads a command a line, answers each with one line. Operations,
 * arguments and results are found in the type information that orbit-idl-2 generates. */
#define _GNU_SOURCE
#define ORBIT2_STUBS_API
#include <ORBitservices/CosNaming.h>
#include <arm.h>
#include <glib.h>
#include <orbit/orbit.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "values.h"

enum { kMostArguments = 8, kMostDoubles = 16 };

static CORBA_Object arm;

/* IDL:Corbot/BadParameter:1.0 -> BadParameter */
static char* short_name(const char* id) {
  const char* slash = strrchr(id, '/');
  char* name = g_strdup(slash != NULL ? slash + 1 : id);
  *strchrnul(name, ':') = '\0';
  return name;
}

static char* exception_text(CORBA_Environment* ev, const ORBit_IMethod* method) {
  char* name = short_name(CORBA_exception_id(ev));
  GString* out = g_string_new(NULL);
  if (ev->_major == CORBA_SYSTEM_EXCEPTION) {
    g_string_printf(out, "exception SYSTEM:%s", name);
  } else {
    g_string_printf(out, "exception %s ", name);
    for (CORBA_unsigned_long i = 0; method != NULL && i < method->exceptions._length; ++i) {
      CORBA_TypeCode tc = method->exceptions._buffer[i];
      if (strcmp(tc->repo_id, CORBA_exception_id(ev)) == 0) write_value(out, tc, CORBA_exception_value(ev));
    }
  }
  g_free(name);
  return g_string_free(out, FALSE);
}

/* ---- Calls ------------------------------------------------------------------------------------------ */

typedef union Argument {
  double number;
  gint32 whole;
  guint64 ticket;
  const char* text;
  Corbot_Point point;
  Corbot_Pose pose;
  guint32 choice;
  Corbot_JointCoord joints;
} Argument;

typedef struct Call {
  ORBit_IMethods* methods;
  CORBA_unsigned_long index;
  Argument arguments[kMostArguments];
  double doubles[kMostDoubles];
} Call;

static bool find_method(Call* call, const char* name, bool attribute) {
  ORBit_IInterface* const interfaces[] = {&Corbot_Robot__iinterface, &Corbot_Arm__iinterface};
  char* wanted = g_strconcat(attribute ? "_get_" : "", name, NULL);
  bool found = false;
  for (size_t k = 0; k < G_N_ELEMENTS(interfaces) && !found; ++k) {
    call->methods = &interfaces[k]->methods;
    for (call->index = 0; call->index < call->methods->_length && !found; ++call->index) {
      found = strcmp(call->methods->_buffer[call->index].name, wanted) == 0;
    }
  }
  --call->index;
  g_free(wanted);
  return found;
}

static const char* next_word(char*** words) {
  while (**words != NULL && ***words == '\0') ++*words;
  return **words == NULL ? "" : *(*words)++;
}

/* A structure of numbers, or of such structures, its opening bracket read; the closing one is read, too. */
static void read_struct(CORBA_TypeCode tc, char* at, char*** words) {
  size_t offset = 0;
  for (CORBA_unsigned_long i = 0; i < tc->sub_parts; ++i) {
    const CORBA_TypeCode member = resolved(tc->subtypes[i]);
    const Layout layout = layout_of(member);
    offset = aligned(offset, layout.alignment);
    const char* word = next_word(words);
    if (member->kind == CORBA_tk_struct) {
      read_struct(member, at + offset, words);
    } else {
      *(double*)(void*)(at + offset) = g_ascii_strtod(word, NULL);
    }
    offset += layout.size;
  }
  (void)next_word(words);
}

/* Its number in the enumeration; one beyond the last for a name that is not in it. */
static guint32 choice_of(CORBA_TypeCode tc, const char* name) {
  guint32 i = 0;
  while (i < tc->sub_parts && strcmp(tc->subnames[i], name) != 0) ++i;
  return i;
}

static void read_argument(Call* call, CORBA_unsigned_long i, char*** words) {
  Argument* argument = &call->arguments[i];
  const CORBA_TypeCode tc = resolved(call->methods->_buffer[call->index].arguments._buffer[i].tc);
  const char* word = next_word(words);
  switch (tc->kind) {
    case CORBA_tk_long:
      argument->whole = (gint32)g_ascii_strtoll(word, NULL, 10);
      return;
    case CORBA_tk_ulonglong:
      argument->ticket = g_ascii_strtoull(word, NULL, 10);
      return;
    case CORBA_tk_string:
      argument->text = word;
      return;
    case CORBA_tk_struct:
      read_struct(tc, (char*)argument, words);
      return;
    case CORBA_tk_enum:
      argument->choice = choice_of(tc, word);
      return;
    case CORBA_tk_sequence: {
      Corbot_JointCoord* joints = &argument->joints;
      joints->_buffer = call->doubles;
      joints->_length = 0;
      while (strcmp(word = next_word(words), "]") != 0 && joints->_length < kMostDoubles) {
        joints->_buffer[joints->_length++] = g_ascii_strtod(word, NULL);
      }
      joints->_maximum = joints->_length;
      return;
    }
    default:
      argument->number = g_ascii_strtod(word, NULL);
  }
}

static char* invoke(Call* call) {
  ORBit_IMethod* method = &call->methods->_buffer[call->index];
  gpointer arguments[kMostArguments];
  for (size_t i = 0; i < kMostArguments; ++i) arguments[i] = &call->arguments[i];
  const CORBA_TypeCode tc = method->ret != NULL ? resolved(method->ret) : NULL;
  union {
    guint64 aligned[8];
    gpointer pointer;
    char bytes[64];
  } result = {{0}};
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  ORBit_small_invoke_stub_n(arm, call->methods, (glong)call->index, &result, arguments, NULL, &ev);
  if (ev._major != CORBA_NO_EXCEPTION) {
    char* text = exception_text(&ev, method);
    CORBA_exception_free(&ev);
    return text;
  }
  GString* out = g_string_new("ok");
  if (tc != NULL && tc->kind != CORBA_tk_void) {
    /* A value without a fixed size comes as a pointer, and this client owns it. */
    const bool by_pointer = tc->kind == CORBA_tk_sequence ||
                            (tc->kind == CORBA_tk_struct && (method->flags & ORBit_I_COMMON_FIXED_SIZE) == 0);
    g_string_append_c(out, ' ');
    write_value(out, tc, by_pointer ? result.pointer : result.bytes);
    if (by_pointer || tc->kind == CORBA_tk_string) CORBA_free(result.pointer);
    if (tc->kind == CORBA_tk_objref) CORBA_Object_release(result.pointer, &ev);
  }
  return g_string_free(out, FALSE);
}

/* The call that the words spell, run; `words` begin with the name. */
static char* run(char** words, bool attribute) {
  Call call;
  memset(&call, 0, sizeof(call));
  const char* name = next_word(&words);
  if (arm == CORBA_OBJECT_NIL) return g_strdup("error not connected");
  if (!find_method(&call, name, attribute))
    return g_strdup_printf("error no operation or attribute %s", name);
  const CORBA_unsigned_long count = call.methods->_buffer[call.index].arguments._length;
  for (CORBA_unsigned_long i = 0; i < count; ++i) read_argument(&call, i, &words);
  return invoke(&call);
}

typedef struct Begun {
  char** words;
  char** from;
} Begun;

static gpointer run_begun(gpointer data) {
  Begun* begun = data;
  char* text = run(begun->from, false);
  g_strfreev(begun->words);
  g_free(begun);
  return text;
}

/* ---- Commands --------------------------------------------------------------------------------------- */

static const ORBit_IMethod* method_of(const ORBit_IInterface* interface, const char* name) {
  for (CORBA_unsigned_long i = 0; i < interface->methods._length; ++i) {
    if (strcmp(interface->methods._buffer[i].name, name) == 0) return &interface->methods._buffer[i];
  }
  return NULL;
}

static char* narrow(CORBA_Object object, CORBA_Environment* ev) {
  if (ev->_major == CORBA_NO_EXCEPTION && !CORBA_Object_is_a(object, (char*)"IDL:Corbot/Arm:1.0", ev) &&
      ev->_major == CORBA_NO_EXCEPTION) {
    CORBA_exception_set_system(ev, ex_CORBA_BAD_PARAM, CORBA_COMPLETED_NO);
  }
  if (ev->_major != CORBA_NO_EXCEPTION) return exception_text(ev, NULL);
  arm = object;
  return g_strdup("ok");
}

static char* resolve(const char* reference, const char* name, CORBA_Environment* ev) {
  CORBA_Object context = CORBA_ORB_string_to_object(orb, (char*)reference, ev);
  if (ev->_major != CORBA_NO_EXCEPTION) return exception_text(ev, NULL);
  CosNaming_NameComponent components[kMostArguments];
  char** parts = g_strsplit(name, "/", kMostArguments);
  CORBA_unsigned_long count = 0;
  for (; parts[count] != NULL; ++count) {
    char* dot = strchr(parts[count], '.');
    components[count].id = parts[count];
    components[count].kind = dot != NULL ? dot + 1 : (char*)"";
    if (dot != NULL) *dot = '\0';
  }
  const CosNaming_Name path = {count, count, components, CORBA_FALSE};
  CORBA_Object found = CosNaming_NamingContext_resolve(context, &path, ev);
  g_strfreev(parts);
  char* raised = NULL;
  if (ev->_major != CORBA_NO_EXCEPTION)
    raised = exception_text(ev, method_of(&CosNaming_NamingContext__iinterface, "resolve"));
  CORBA_exception_free(ev);
  CORBA_Object_release(context, ev);
  return raised != NULL ? raised : narrow(found, ev);
}

static char* answer(char** words, GHashTable* threads, bool* keep_words) {
  char** from = words;
  const char* command = next_word(&from);
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  char* text = NULL;
  if (strcmp(command, "connect") == 0) {
    text = narrow(CORBA_ORB_string_to_object(orb, (char*)next_word(&from), &ev), &ev);
  } else if (strcmp(command, "resolve") == 0) {
    const char* reference = next_word(&from);
    text = resolve(reference, next_word(&from), &ev);
  } else if (strcmp(command, "get") == 0 || strcmp(command, "call") == 0) {
    text = run(from, strcmp(command, "get") == 0);
  } else if (strcmp(command, "begin") == 0) {
    Begun* begun = g_new0(Begun, 1);
    char* tag = g_strdup(next_word(&from)); /* the thread frees the words */
    begun->words = words;
    begun->from = from;
    *keep_words = true;
    g_hash_table_insert(threads, tag, g_thread_new("begun", run_begun, begun));
    text = g_strdup("ok");
  } else if (strcmp(command, "end") == 0) {
    const char* tag = next_word(&from);
    GThread* thread = g_hash_table_lookup(threads, tag);
    text = thread != NULL ? g_thread_join(thread) : g_strdup_printf("error nothing was begun as %s", tag);
    g_hash_table_remove(threads, tag);
  } else {
    text = g_strdup_printf("error no command %s", command);
  }
  CORBA_exception_free(&ev);
  return text;
}

/* Every bracket a word of its own. */
static char** words_of(const char* line) {
  GString* spaced = g_string_new(NULL);
  for (const char* c = line; *c != '\0'; ++c) {
    g_string_append_printf(spaced, strchr("{}[]", *c) != NULL ? " %c " : "%c", *c == '\n' ? ' ' : *c);
  }
  char** words = g_strsplit(spaced->str, " ", -1);
  g_string_free(spaced, TRUE);
  return words;
}

int main(void) {
  /* The default would end a call that takes longer than a minute. */
  char* options[] = {
      (char*)"client",           (char*)"--ORBNoUserRC",       (char*)"yes", (char*)"--ORBIIOPIPv4=1",
      (char*)"--ORBIIOPUSock=1", (char*)"--GIOPTimeoutMSEC=0", NULL};
  int count = 6;
  CORBA_Environment ev;
  CORBA_exception_init(&ev);
  orb = CORBA_ORB_init(&count, options, (char*)"orbit-io-thread", &ev);
  if (ev._major != CORBA_NO_EXCEPTION) return 1;
  GHashTable* threads = g_hash_table_new_full(g_str_hash, g_str_equal, g_free, NULL);
  char* line = NULL;
  size_t size = 0;
  while (getline(&line, &size, stdin) >= 0) {
    bool keep_words = false;
    char** words = words_of(line);
    char* text = answer(words, threads, &keep_words);
    if (!keep_words) g_strfreev(words);
    (void)printf("%s\n", g_strdelimit(text, "\n", ' '));
    (void)fflush(stdout);
    g_free(text);
  }
  return 0;
}
