# SPDX-License-Identifier: Apache-2.0
corbot_test(can_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/can/frames_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/can/link_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/can/node_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/can/node_faults_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/can/following_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/can/grip_limit_test.cpp
  LIBS corbot::backends corbot::sim_devices corbot::config corbot::planner
  LABELS unit)
target_include_directories(can_test PRIVATE ${PROJECT_SOURCE_DIR}/tests)
target_compile_definitions(can_test PRIVATE CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests"
                                            CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles")

# The backend and the emulator's program on a virtual bus, or on the interface CORBOT_RIG_CAN.
corbot_test(drives_on_can_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/can/drives_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/can/restarts_test.cpp
    ${CMAKE_CURRENT_SOURCE_DIR}/can/gripping_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/can/drive_faults_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/can/drive_setup_test.cpp
    ${CMAKE_CURRENT_SOURCE_DIR}/can/homing_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/can/sdo_client_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/can/watch_test.cpp
  LIBS corbot_process corbot::backends
  LABELS unit
  DEPENDS corbot-sim)
target_include_directories(drives_on_can_test PRIVATE ${PROJECT_SOURCE_DIR}/tests)
target_compile_definitions(drives_on_can_test PRIVATE CORBOT_SIM_PROGRAM="$<TARGET_FILE:corbot-sim>"
                                                        CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")
