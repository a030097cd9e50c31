# SPDX-License-Identifier: Apache-2.0
if(TARGET corbot_cli)
  set(here ${CMAKE_CURRENT_SOURCE_DIR}/cli)
  corbot_test(test_cli
    SOURCES ${here}/program_test.cpp ${here}/state_test.cpp ${here}/doctor_test.cpp ${here}/views_test.cpp
            ${here}/calibration_test.cpp ${here}/notify_test.cpp ${here}/report_test.cpp
    LIBS corbot::cli corbot_process fmt::fmt
    DEPENDS notifying_child corbot-rt)
  corbot_test(test_arm_commands
    SOURCES ${here}/arm_test.cpp
    LIBS corbot::cli nlohmann_json::nlohmann_json fmt::fmt
    LABELS unit)
  target_compile_definitions(test_arm_commands PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles")
  corbot_test(doctor_devices_test
    SOURCES ${here}/doctor_devices_test.cpp ${here}/doctor_lines_test.cpp
    LIBS corbot::cli corbot::backends corbot::sim_devices corbot_process fmt::fmt
    LABELS unit
    DEPENDS corbot-sim)
  target_include_directories(doctor_devices_test PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_compile_definitions(doctor_devices_test PRIVATE CORBOT_SIM_PROGRAM="$<TARGET_FILE:corbot-sim>"
                                                         CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")
  add_executable(notifying_child ${here}/notifying_child.cpp)
  corbot_target(notifying_child)
  target_link_libraries(notifying_child PRIVATE PkgConfig::SYSTEMD)
  set_target_properties(notifying_child PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  target_compile_definitions(test_cli PRIVATE NOTIFYING_CHILD="${CMAKE_BINARY_DIR}/tests/notifying_child")
  target_compile_definitions(test_cli PRIVATE CORBOT_EXAMPLES="${PROJECT_SOURCE_DIR}/examples"
                                              CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles"
                                              CORBOT_BIN_DIR="${CMAKE_BINARY_DIR}/bin"
                                              CORBOT_PROFILE="${CORBOT_TEST_PROFILE}")
endif()
