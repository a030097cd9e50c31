# SPDX-License-Identifier: Apache-2.0
# Defines how all targets are compiled and linked.

# Sets the compile options of every target of this project; generated code is not compiled with them.
# CORBOT_UNITY compiles up to 32 sources of a target as one, because included headers take most of the time.
function(corbot_target target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${CORBOT_UNITY} UNITY_BUILD_BATCH_SIZE 32)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
    -Wno-sign-conversion -Werror)
  target_link_libraries(${target} PRIVATE corbot::headers Threads::Threads)
endfunction()

# Hardening. -z now also concerns timing: with lazy binding the first call of each library function runs the
# loader inside the cycle. An example is hypot on the first line. tests/unit/rt/binding_test shows that no
# such call remains.
include(CheckPIESupported)
check_pie_supported()
add_compile_options(-fstack-protector-strong)
add_link_options(-Wl,-z,relro -Wl,-z,now)
if(NOT CORBOT_SANITIZE)
  # Needs an optimising build. The sanitizers check more, and do not support the checked functions.
  add_compile_options($<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE>
    $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=2>)
endif()

# A program on ORBit2. The leak sanitizer ignores the leaks of ORBit2 itself.
function(corbot_on_orbit2 target)
  # The sources are in C, in which two files often share a static name.
  set_target_properties(${target} PROPERTIES UNITY_BUILD OFF)
  target_link_libraries(${target} PRIVATE corbot::idl_orbit2)
  if(CORBOT_SANITIZE MATCHES address)
    target_sources(${target} PRIVATE ${PROJECT_SOURCE_DIR}/tests/support/orbit2_leaks.c)
  endif()
endfunction()

if(CORBOT_SANITIZE)
  # -O0 takes half the build time of -O1, which would mostly optimise the sanitizer's own checks. Line tables
  # give as good a stack trace as -g.
  add_compile_options(-fsanitize=${CORBOT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all -O0
    -gline-tables-only)
  add_link_options(-fsanitize=${CORBOT_SANITIZE})
  if(CORBOT_SANITIZE MATCHES undefined)
    add_compile_options(-fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/cmake/sanitizer_ignores.txt)
  endif()
endif()

# Marks a target in which tests compute for long. The sanitizers' builds optimise no other.
function(corbot_computes target)
  if(CORBOT_SANITIZE)
    target_compile_options(${target} PRIVATE -O1)
  endif()
endfunction()

# Links the libraries among LIBS that compute before the objects of a test. The linker keeps the first copy of
# an inline function, which is optimised then.
function(corbot_link_optimised_first name libraries)
  foreach(library IN ITEMS corbot_planner corbot_rt_core)
    string(REPLACE "corbot_" "corbot::" alias ${library})
    if(alias IN_LIST libraries)
      target_link_options(${name} PRIVATE
        "SHELL:-Wl,--whole-archive $<TARGET_FILE:${library}> -Wl,--no-whole-archive")
    endif()
  endforeach()
endfunction()

# These options are for what mostly waits. At -Og GCC considers variables that the library's own code sets as
# uninitialised.
set(CORBOT_WAITS $<$<NOT:$<CONFIG:Debug>>:-Og> $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
if(CORBOT_SANITIZE)
  set(CORBOT_WAITS)
endif()

# Marks a target that mostly waits, such as a client of robots: the build optimises it less, in two thirds of
# the time.
function(corbot_waits target)
  target_compile_options(${target} PRIVATE ${CORBOT_WAITS})
endfunction()

# Marks one source of a target that computes, such as the options of its command line. It stays out of unity.
function(corbot_source_waits source)
  set_source_files_properties(${source} PROPERTIES COMPILE_OPTIONS "${CORBOT_WAITS}")
endfunction()

# Marks test code that waits for other processes. Without optimisation and debug information the build takes
# three quarters of the time of -Og. A failed expectation prints its line. In a program that also has the
# product's code, the linker may keep the test's copy of an inline function, apart from those of
# corbot_link_optimised_first. Such a program's times are not the product's.
# Benchmarks link some of this code, so their build has -Og.
function(corbot_waits_for_processes target)
  if(CORBOT_BENCH)
    corbot_waits(${target})
  elseif(NOT CORBOT_SANITIZE)
    target_compile_options(${target} PRIVATE
      "$<$<NOT:$<CONFIG:Debug>>:SHELL:-O0 -g0 -U_FORTIFY_SOURCE>")
  endif()
endfunction()

# Each test has a tier. A test of the tier core starts none of corbot's programs. A test of process needs such
# programs, or an ORB. The gate skips tests of long, which take too much time. The gate also runs core under
# the address sanitizer.
set(CORBOT_TIERS core process long)
# THREADS marks the programs that also run under the thread sanitizer. Their label is core-threads or
# process-threads, one word because the discovery of GoogleTest's cases splits lists. The libraries of the ORB
# and of OpenCV are not instrumented. Code that goes through them would report false races.
# The gate's sanitizers skip programs with SANITIZED_AT_NIGHT, which take much time to compile or to run.
add_custom_target(corbot_core_tests)
add_custom_target(corbot_threads_tests)

function(corbot_check_tier test tier)
  if(NOT tier IN_LIST CORBOT_TIERS)
    message(FATAL_ERROR "the test ${test} has the tier '${tier}', and must have one of: ${CORBOT_TIERS}")
  endif()
endfunction()

# The thread sanitizer skips a core program without THREADS, so no source of it may start a thread. A test of
# the camera may: it has threads, and OpenCV is not instrumented.
function(corbot_check_one_thread name)
  foreach(source IN LISTS ARGN)
    get_filename_component(source ${source} ABSOLUTE)
    file(STRINGS ${source} threads REGEX "std::(j?thread|async)[^A-Za-z0-9_:]")
    if(threads)
      message(FATAL_ERROR "${source} starts threads: the core test ${name} needs THREADS, or another place")
    endif()
  endforeach()
endfunction()

# Registers a core program under a sanitizer: each test is a twelfth of its cases. A start of the program
# takes longer than most cases. The limit is that of many cases, beside others.
function(corbot_discover_shares name label)
  set(shares 12)
  math(EXPR last "${shares} - 1")
  foreach(share RANGE ${last})
    add_test(NAME ${name}.${share} COMMAND ${name})
    set_tests_properties(${name}.${share} PROPERTIES ${ARGN} LABELS ${label} TIMEOUT 900
      ENVIRONMENT "GTEST_TOTAL_SHARDS=${shares};GTEST_SHARD_INDEX=${share}")
  endforeach()
endfunction()

# Registers the cases of a program; those in `long_cases` get the label long.
function(corbot_discover name prefix long_cases label)
  set(options DISCOVERY_TIMEOUT 60 TEST_PREFIX "${prefix}")
  if(NOT long_cases)
    gtest_discover_tests(${name} ${options} TEST_LIST "${name}_${prefix}" PROPERTIES ${ARGN} LABELS ${label})
    return()
  endif()
  gtest_discover_tests(${name} ${options} TEST_LIST "${name}_${prefix}" TEST_FILTER "-${long_cases}"
    PROPERTIES ${ARGN} LABELS ${label})
  gtest_discover_tests(${name} ${options} TEST_LIST "${name}_${prefix}_long" TEST_FILTER "${long_cases}"
    PROPERTIES ${ARGN} LABELS long)
endfunction()

# corbot_test(NAME TIER tier SOURCES… LIBS …) adds one GoogleTest program and registers its cases with ctest
# under the label of the tier. LONG names cases of the tier long, in the syntax of --gtest_filter: repetitions
# on a similar device, arm or client. BOTH_ORBS registers them a second time, as orbit2.*, with the servant on
# ORBit2, if that is built. COMPUTES marks a program that computes for long. Release optimises these,
# and the sanitizers' builds those with SANITIZED_AT_NIGHT: for few cases that costs more than it saves.
# The other programs mostly wait, and are compiled for a short build. PROCESSORS is the number of ctest's
# processors that a case takes, of which scripts/common.sh sets six or eight for each of the machine's. The
# cases of a program that computes run one after another, beside all that wait. With sanitizers each of these
# cases takes six instead. COST: ctest begins the tests with the highest number first, so
# that no long one remains for the end. A gap goes to any case that fits. So cases of several processors have
# a COST, and begin while all are free.
# ALONE: ctest runs no other test at the same time. A real-time thread that computes for seconds delays the
# kernel's work for pseudo-terminals, among others.
function(corbot_test name)
  cmake_parse_arguments(arg "ALONE;BOTH_ORBS;COMPUTES;SANITIZED_AT_NIGHT;THREADS"
    "TIER;TIMEOUT;PROCESSORS;COST;LONG" "SOURCES;LIBS;DEPENDS" ${ARGN})
  corbot_check_tier(${name} "${arg_TIER}")
  if(arg_THREADS AND arg_SANITIZED_AT_NIGHT)
    message(FATAL_ERROR "${name}: the thread sanitizer would run it neither in the gate nor at night")
  endif()
  if(CORBOT_SANITIZE AND arg_SANITIZED_AT_NIGHT)
    set(arg_TIER long)
  endif()
  if(arg_TIER STREQUAL core AND NOT arg_THREADS AND NOT corbot::cell_camera IN_LIST arg_LIBS)
    corbot_check_one_thread(${name} ${arg_SOURCES})
  endif()
  add_executable(${name} ${arg_SOURCES})
  corbot_target(${name})
  if(arg_COMPUTES)
    if(arg_SANITIZED_AT_NIGHT)
      corbot_computes(${name})
    endif()
  elseif(arg_TIER STREQUAL process)
    corbot_waits_for_processes(${name})
  else()
    corbot_waits(${name})
  endif()
  corbot_link_optimised_first(${name} "${arg_LIBS}")
  if(CORBOT_SANITIZE MATCHES undefined)
    # A fifth of the build time of a test. The address sanitizer reports null pointers, too.
    target_compile_options(${name} PRIVATE -fno-sanitize=null,alignment,vptr,object-size)
  endif()
  target_link_libraries(${name} PRIVATE ${arg_LIBS} corbot_test_headers GTest::gtest GTest::gmock
    GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  set(label ${arg_TIER})
  if(arg_THREADS AND NOT arg_TIER STREQUAL long)
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
    if(arg_COMPUTES AND CORBOT_SANITIZE)
      set(arg_PROCESSORS 6)
    endif()
  endif()
  set(properties TIMEOUT ${arg_TIMEOUT} PROCESSORS ${arg_PROCESSORS})
  if(arg_COMPUTES AND NOT CORBOT_SANITIZE)
    list(APPEND properties RESOURCE_LOCK ${name})
  endif()
  if(arg_COST)
    list(APPEND properties COST ${arg_COST})
  endif()
  if(arg_ALONE)
    list(APPEND properties RUN_SERIAL TRUE)
  endif()
  if(CORBOT_SANITIZE AND (arg_TIER STREQUAL core OR arg_SANITIZED_AT_NIGHT))
    corbot_discover_shares(${name} ${label} ${properties})
    return()
  endif()
  corbot_discover(${name} "" "${arg_LONG}" ${label} ${properties})
  if(arg_BOTH_ORBS AND TARGET corbot-servant-orbit2)
    add_dependencies(${name} corbot-servant-orbit2)
    corbot_discover(${name} orbit2. "${arg_LONG}" ${label} ${properties} ENVIRONMENT CORBOT_TEST_ORB=orbit2)
  endif()
endfunction()

# corbot_command_test(NAME TIER tier COMMAND … PROPERTIES …) adds a test that is no GoogleTest program.
function(corbot_command_test name)
  cmake_parse_arguments(arg "SANITIZED_AT_NIGHT;THREADS" "TIER" "COMMAND;PROPERTIES" ${ARGN})
  corbot_check_tier(${name} "${arg_TIER}")
  if(CORBOT_SANITIZE AND arg_SANITIZED_AT_NIGHT)
    set(arg_TIER long)
  endif()
  add_test(NAME ${name} COMMAND ${arg_COMMAND})
  set(label ${arg_TIER})
  if(arg_THREADS AND NOT arg_TIER STREQUAL long)
    string(APPEND label -threads)
  endif()
  set_tests_properties(${name} PROPERTIES LABELS ${label} ${arg_PROPERTIES})
endfunction()
