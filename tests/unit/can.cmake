# SPDX-License-Identifier: Apache-2.0
corbot_test(can_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/can/frames_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/can/node_test.cpp
  LIBS corbot::backends corbot::sim_devices
  LABELS unit)
