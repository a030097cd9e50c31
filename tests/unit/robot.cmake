find_package(nlohmann_json REQUIRED)
corbot_test(test_robot
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/robot/ticket_table_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/alarm_log_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/robot/c_api_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/save_policy_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/robot/audit_log_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/control_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/forged_state_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/robot/progress_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/self_check_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/robot/refusal_units_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/published_test.cpp
  LIBS corbot::robot fmt::fmt nlohmann_json::nlohmann_json
  LABELS unit)
target_include_directories(test_robot PRIVATE ${CMAKE_SOURCE_DIR}/tests)
target_compile_definitions(test_robot PRIVATE CORBOT_PROFILE="${CMAKE_SOURCE_DIR}/profiles/lynx5.toml"
                                              CORBOT_PROFILES="${CMAKE_SOURCE_DIR}/profiles"
                                              CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")

# The robot over a segment whose other side is the test, or the real loop in a thread of the test.
corbot_test(test_robot_task
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/robot/arm_state_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/cancel_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/clear_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/controlled_calls_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/robot/error_cause_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/frames_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/robot/hold_calls_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/restart_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/robot/inherit_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/poses_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/robot/refused_calls_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/stop_order_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/wake_up_test.cpp
          ${PROJECT_SOURCE_DIR}/rt/loop.cpp
  LIBS corbot::robot corbot::rt_core corbot::loopback corbot_process fmt::fmt nlohmann_json::nlohmann_json
  LABELS unit)
target_include_directories(test_robot_task PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_SOURCE_DIR}/tests)
target_compile_definitions(test_robot_task PRIVATE CORBOT_PROFILE="${CMAKE_SOURCE_DIR}/profiles/lynx5.toml"
                                                   CORBOT_PROFILES="${CMAKE_SOURCE_DIR}/profiles"
                                                   CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")
