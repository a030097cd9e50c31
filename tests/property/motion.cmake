# SPDX-License-Identifier: Apache-2.0
corbot_test(motion_property_test COMPUTES TIMEOUT 900 LABELS property
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/motion/motion_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/motion/watcher.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/motion/stop_judge.cpp
  LIBS corbot::rt_core corbot::loopback corbot::planner corbot::config fmt::fmt)
target_include_directories(motion_property_test PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/../unit)
target_compile_definitions(motion_property_test PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles")
