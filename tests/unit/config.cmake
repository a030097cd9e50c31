corbot_test(unit_config
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/config/profile_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/config/faults_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/config/profile_edit_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/config/can_profile_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/config/similar_test.cpp
  LIBS corbot::config
  LABELS unit)
target_compile_definitions(unit_config PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles")
