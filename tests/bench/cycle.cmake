# SPDX-License-Identifier: Apache-2.0
add_executable(cycle_bench ${CMAKE_CURRENT_SOURCE_DIR}/cycle/cycle_bench.cpp)
corbot_target(cycle_bench)
target_include_directories(cycle_bench PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/../unit)
target_link_libraries(cycle_bench PRIVATE corbot_test_headers corbot::rt_core corbot::loopback corbot::planner
                                          corbot::config fmt::fmt)
set_target_properties(cycle_bench PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
corbot_command_test(cycle_bench TIER long COMMAND cycle_bench PROPERTIES RUN_SERIAL ON TIMEOUT 120)
