# SPDX-License-Identifier: Apache-2.0
add_executable(cycle_bench ${CMAKE_CURRENT_SOURCE_DIR}/cycle/cycle_bench.cpp)
corbot_target(cycle_bench)
target_include_directories(cycle_bench PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/../unit)
target_compile_definitions(cycle_bench PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles")
target_link_libraries(cycle_bench PRIVATE corbot::rt_core corbot::loopback corbot::planner corbot::config fmt::fmt)
set_target_properties(cycle_bench PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
add_test(NAME cycle_bench COMMAND cycle_bench)
set_tests_properties(cycle_bench PROPERTIES LABELS bench RUN_SERIAL ON TIMEOUT 120)
