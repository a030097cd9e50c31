corbot_test(test_robot
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/robot/ticket_table_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/alarm_log_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/robot/c_api_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/save_policy_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/robot/progress_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/robot/self_check_test.cpp
  LIBS corbot::robot fmt::fmt
  LABELS unit)
target_compile_definitions(test_robot PRIVATE CORBOT_PROFILE="${CMAKE_SOURCE_DIR}/profiles/lynx5.toml")
