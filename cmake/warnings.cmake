# What every target of this project is compiled with; generated code is not.
function(corbot_target target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror)
  target_link_libraries(${target} PRIVATE corbot::headers Threads::Threads)
endfunction()

# A program on ORBit2: under the sanitizers, what ORBit2 itself leaks is not held against it.
function(corbot_on_orbit2 target)
  target_link_libraries(${target} PRIVATE corbot::idl_orbit2)
  if(CORBOT_SANITIZE MATCHES address)
    target_sources(${target} PRIVATE ${PROJECT_SOURCE_DIR}/tests/support/orbit2_leaks.c)
  endif()
endfunction()

if(CORBOT_SANITIZE)
  add_compile_options(-fsanitize=${CORBOT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${CORBOT_SANITIZE})
endif()

# corbot_test(NAME SOURCES… LIBS …): one GoogleTest program, its cases registered with ctest. BOTH_ORBS registers them a
# second time, as orbit2.*, with the servant on ORBit2, where that is built.
function(corbot_test name)
  cmake_parse_arguments(arg "BOTH_ORBS" "TIMEOUT" "SOURCES;LIBS;LABELS;DEPENDS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  corbot_target(${name})
  target_link_libraries(${name} PRIVATE ${arg_LIBS} GTest::gtest GTest::gmock GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  if(arg_DEPENDS)
    add_dependencies(${name} ${arg_DEPENDS})
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${arg_LABELS}")
  if(arg_BOTH_ORBS AND TARGET corbot-servant-orbit2)
    add_dependencies(${name} corbot-servant-orbit2)
    gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 TEST_PREFIX orbit2. TEST_LIST ${name}_on_orbit2
      PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${arg_LABELS}" ENVIRONMENT CORBOT_TEST_ORB=orbit2)
  endif()
endfunction()
