# SPDX-License-Identifier: Apache-2.0
corbot_test(state_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/state/position_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/state/soft_limits_test.cpp
  LIBS corbot::state corbot::config fmt::fmt)
target_compile_definitions(state_test PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles"
                                              CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")
