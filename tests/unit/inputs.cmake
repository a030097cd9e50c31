# SPDX-License-Identifier: Apache-2.0
corbot_test(inputs_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/inputs/stop_logic_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/inputs/safety_lines_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/inputs/watchdog_test.cpp
  LIBS corbot::inputs)
target_include_directories(inputs_test PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/tests)
