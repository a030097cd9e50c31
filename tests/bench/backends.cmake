# SPDX-License-Identifier: Apache-2.0
add_executable(backend_bench ${CMAKE_CURRENT_SOURCE_DIR}/backends/backend_bench.cpp)
corbot_target(backend_bench)
target_link_libraries(backend_bench PRIVATE corbot_test_headers corbot_device_fixtures)
add_dependencies(backend_bench corbot-sim)
set_target_properties(backend_bench PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
corbot_command_test(backend_bench TIER long COMMAND backend_bench PROPERTIES RUN_SERIAL ON TIMEOUT 300)
