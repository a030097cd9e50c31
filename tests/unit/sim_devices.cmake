# SPDX-License-Identifier: Apache-2.0
corbot_test(sim_devices_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/sim_devices/ssc32_moves_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/sim_devices/ssc32_commands_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/sim_devices/maestro_protocol_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/sim_devices/maestro_motion_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/sim_devices/maestro_settings_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/sim_devices/random_input_test.cpp
  LIBS corbot::sim_devices
  LABELS unit)
target_include_directories(sim_devices_test PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})

# The program, by a pseudo-terminal.
corbot_test(corbot_sim_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/sim_devices/corbot_sim_test.cpp
  LIBS corbot_process
  LABELS unit
  DEPENDS corbot-sim)
target_include_directories(corbot_sim_test PRIVATE ${PROJECT_SOURCE_DIR}/tests)
target_compile_definitions(corbot_sim_test PRIVATE CORBOT_SIM_PROGRAM="$<TARGET_FILE:corbot-sim>"
                                                   CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")
