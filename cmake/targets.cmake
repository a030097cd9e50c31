# SPDX-License-Identifier: Apache-2.0
# How everything here is compiled and linked.

# What every target of this project is compiled with; generated code is not.
# CORBOT_UNITY compiles up to 16 sources of a target as one: most of the time goes into what sources include.
function(corbot_target target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${CORBOT_UNITY} UNITY_BUILD_BATCH_SIZE 16)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror)
  target_link_libraries(${target} PRIVATE corbot::headers Threads::Threads)
endfunction()

# Hardening. -z now is also a matter of time: with lazy binding the first call of each library function, hypot on the first
# line, runs the loader inside the cycle. tests/unit/rt/binding_test shows that none does.
include(CheckPIESupported)
check_pie_supported()
add_compile_options(-fstack-protector-strong)
add_link_options(-Wl,-z,relro -Wl,-z,now)
if(NOT CORBOT_SANITIZE)
  # Needs an optimising build; the sanitizers check more, and know nothing of the checked functions.
  add_compile_options($<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE> $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=2>)
endif()

# A program on ORBit2: under the sanitizers, what ORBit2 itself leaks is not held against it.
function(corbot_on_orbit2 target)
  target_link_libraries(${target} PRIVATE corbot::idl_orbit2)
  if(CORBOT_SANITIZE MATCHES address)
    target_sources(${target} PRIVATE ${PROJECT_SOURCE_DIR}/tests/support/orbit2_leaks.c)
  endif()
endfunction()

if(CORBOT_SANITIZE)
  # -O1 and line tables: half the time to build of -O2 -g, and as much of a stack trace.
  add_compile_options(-fsanitize=${CORBOT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all -O1 -gline-tables-only)
  add_link_options(-fsanitize=${CORBOT_SANITIZE})
endif()

# Each test has a tier. A test of the tier core runs in one process; one of process needs real processes, ORBs, sockets or
# signals; the gate has no time for one of long. The gate runs core under the address sanitizer, too.
set(CORBOT_TIERS core process long)
# THREADS marks the programs that the thread sanitizer is run on: their label is core-threads or process-threads, one word
# because the discovery of GoogleTest's cases splits lists. The ORB's own library and OpenCV's are not instrumented:
# what runs through them would report races that they have not.
add_custom_target(corbot_core_tests)
add_custom_target(corbot_threads_tests)

function(corbot_check_tier test tier)
  if(NOT tier IN_LIST CORBOT_TIERS)
    message(FATAL_ERROR "the test ${test} has the tier '${tier}', and must have one of: ${CORBOT_TIERS}")
  endif()
endfunction()

# What docs/safety.md promises is shown by the gate, for every device and arm: no test that it names is of the tier long.
file(STRINGS ${PROJECT_SOURCE_DIR}/docs/safety.md promises REGEX "`[A-Z][A-Za-z0-9]*\\.[A-Z]")
string(REGEX MATCHALL "`[A-Z][A-Za-z0-9]*\\.[A-Z][A-Za-z0-9]*`" CORBOT_PROMISED_TESTS "${promises}")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/docs/safety.md)

function(corbot_check_no_promise long_cases)
  string(REPLACE ":" ";" patterns "${long_cases}")
  foreach(pattern IN LISTS patterns)
    string(REGEX REPLACE "^[^/.]*/|/[^/]*$" "" case "${pattern}")  # Instance/Suite.Case/parameter
    string(REPLACE "." "\\." case "${case}")
    string(REPLACE "*" ".*" case "${case}")
    foreach(promised IN LISTS CORBOT_PROMISED_TESTS)
      if(promised MATCHES "^`${case}`$")
        message(FATAL_ERROR "docs/safety.md names the test ${promised}: '${pattern}' must not be LONG")
      endif()
    endforeach()
  endforeach()
endfunction()

# Registers the cases of a program, those that `long_cases` names under the label long.
function(corbot_discover name prefix long_cases label)
  set(options DISCOVERY_TIMEOUT 60 TEST_PREFIX "${prefix}")
  if(NOT long_cases)
    gtest_discover_tests(${name} ${options} TEST_LIST "${name}_${prefix}" PROPERTIES ${ARGN} LABELS ${label})
    return()
  endif()
  corbot_check_no_promise("${long_cases}")
  gtest_discover_tests(${name} ${options} TEST_LIST "${name}_${prefix}" TEST_FILTER "-${long_cases}"
    PROPERTIES ${ARGN} LABELS ${label})
  gtest_discover_tests(${name} ${options} TEST_LIST "${name}_${prefix}_long" TEST_FILTER "${long_cases}"
    PROPERTIES ${ARGN} LABELS long)
endfunction()

# corbot_test(NAME TIER tier SOURCES… LIBS …): one GoogleTest program, its cases registered with ctest under the label of the
# tier. LONG names cases, in the syntax of --gtest_filter, that are of the tier long: repetitions on a like device, arm or client.
# BOTH_ORBS registers them a second time, as orbit2.*, with the servant on ORBit2, if that is built. COMPUTES: the program
# computes for long, so it is optimised like the products and takes two processors of ctest's; the others mostly wait, and are
# compiled for a short build. PROCESSORS: as many of ctest's, for a test that starts many programs. COST: ctest begins the
# tests with the highest number first, so that none that takes long is left over at the end. ALONE: ctest runs no other test
# beside it. A real-time thread that computes for seconds holds up what the kernel does for pseudo-terminals, among others.
function(corbot_test name)
  cmake_parse_arguments(arg "ALONE;BOTH_ORBS;COMPUTES;THREADS" "TIER;TIMEOUT;PROCESSORS;COST;LONG" "SOURCES;LIBS;DEPENDS" ${ARGN})
  corbot_check_tier(${name} "${arg_TIER}")
  add_executable(${name} ${arg_SOURCES})
  corbot_target(${name})
  if(NOT arg_COMPUTES)
    set(optimised -Og)
    if(CORBOT_SANITIZE)
      set(optimised -O0)  # a third of the time to build of -O1
    endif()
    # At -Og GCC takes what the library's own code sets for unset.
    target_compile_options(${name} PRIVATE $<$<NOT:$<CONFIG:Debug>>:${optimised}> $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  endif()
  target_link_libraries(${name} PRIVATE ${arg_LIBS} corbot_test_headers GTest::gtest GTest::gmock GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  set(label ${arg_TIER})
  if(arg_THREADS)
    string(APPEND label -threads)
    add_dependencies(corbot_threads_tests ${name})
  endif()
  if(arg_TIER STREQUAL core)
    add_dependencies(corbot_core_tests ${name})
  endif()
  if(arg_DEPENDS)
    add_dependencies(${name} ${arg_DEPENDS})
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 300)
  endif()
  if(NOT arg_PROCESSORS)
    set(arg_PROCESSORS 1)
    if(arg_COMPUTES)
      set(arg_PROCESSORS 2)
    endif()
  endif()
  set(properties TIMEOUT ${arg_TIMEOUT} PROCESSORS ${arg_PROCESSORS})
  if(arg_COST)
    list(APPEND properties COST ${arg_COST})
  endif()
  if(arg_ALONE)
    list(APPEND properties RUN_SERIAL TRUE)
  endif()
  corbot_discover(${name} "" "${arg_LONG}" ${label} ${properties})
  if(arg_BOTH_ORBS AND TARGET corbot-servant-orbit2)
    add_dependencies(${name} corbot-servant-orbit2)
    corbot_discover(${name} orbit2. "${arg_LONG}" ${label} ${properties} ENVIRONMENT CORBOT_TEST_ORB=orbit2)
  endif()
endfunction()

# corbot_command_test(NAME TIER tier COMMAND … PROPERTIES …): a test that is no GoogleTest program.
function(corbot_command_test name)
  cmake_parse_arguments(arg "THREADS" "TIER" "COMMAND;PROPERTIES" ${ARGN})
  corbot_check_tier(${name} "${arg_TIER}")
  add_test(NAME ${name} COMMAND ${arg_COMMAND})
  set(label ${arg_TIER})
  if(arg_THREADS)
    string(APPEND label -threads)
  endif()
  set_tests_properties(${name} PROPERTIES LABELS ${label} ${arg_PROPERTIES})
endfunction()
