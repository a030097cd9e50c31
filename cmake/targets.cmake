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

# What the thread sanitizer is run on: `ctest -L` with these labels. The ORB's own library is not instrumented, and what runs
# through it would report races that it has not; the property tests compute in one thread.
set(CORBOT_TSAN_LABELS "unit|model")
add_custom_target(corbot_tsan_tests)

# corbot_test(NAME SOURCES… LIBS …): one GoogleTest program, its cases registered with ctest. BOTH_ORBS registers them a
# second time, as orbit2.*, with the servant on ORBit2, where that is built. COMPUTES: it does so for long, so
# it is optimised like the programs and takes two processors of ctest's; the others mostly wait, and are compiled for a short
# build. PROCESSORS: as many of ctest's, for a test that starts many programs.
function(corbot_test name)
  cmake_parse_arguments(arg "BOTH_ORBS;COMPUTES" "TIMEOUT;PROCESSORS" "SOURCES;LIBS;LABELS;DEPENDS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  corbot_target(${name})
  if(NOT arg_COMPUTES AND NOT CORBOT_SANITIZE)
    target_compile_options(${name} PRIVATE $<$<NOT:$<CONFIG:Debug>>:-O1> -g1)
  endif()
  target_link_libraries(${name} PRIVATE ${arg_LIBS} GTest::gtest GTest::gmock GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  if(arg_DEPENDS)
    add_dependencies(${name} ${arg_DEPENDS})
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  set(processors 1)
  if(arg_COMPUTES)
    set(processors 2)
  endif()
  if(arg_PROCESSORS)
    set(processors ${arg_PROCESSORS})
  endif()
  if(arg_LABELS MATCHES "${CORBOT_TSAN_LABELS}")
    add_dependencies(corbot_tsan_tests ${name})
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT ${arg_TIMEOUT} PROCESSORS ${processors} LABELS "${arg_LABELS}")
  if(arg_BOTH_ORBS AND TARGET corbot-servant-orbit2)
    add_dependencies(${name} corbot-servant-orbit2)
    gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 TEST_PREFIX orbit2. TEST_LIST ${name}_on_orbit2
      PROPERTIES TIMEOUT ${arg_TIMEOUT} PROCESSORS ${processors} LABELS "${arg_LABELS}" ENVIRONMENT CORBOT_TEST_ORB=orbit2)
  endif()
endfunction()
