corbot_test(unit_config
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/config/profile_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/config/faults_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/config/profile_edit_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/config/can_profile_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/config/similar_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/config/arm_profile_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/config/urdf_profile_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/config/urdf_export_test.cpp
  LIBS corbot::config
  LABELS unit)
target_compile_definitions(unit_config PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles")
corbot_test(test_arm_recognition
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/config/arm_recognition_test.cpp
  LIBS corbot::config
  LABELS unit)
target_include_directories(test_arm_recognition PRIVATE ${PROJECT_SOURCE_DIR}/tests/support)
target_compile_definitions(test_arm_recognition PRIVATE CORBOT_ARM_VECTORS="${PROJECT_SOURCE_DIR}/tests/vectors/arms")
corbot_test(test_shipped_arms
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/config/shipped_arms_test.cpp
  LIBS corbot::config corbot::planner Eigen3::Eigen
  LABELS unit)
target_include_directories(test_shipped_arms PRIVATE ${PROJECT_SOURCE_DIR}/tests/support)
target_compile_definitions(test_shipped_arms PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles"
  CORBOT_ARM_VECTORS="${PROJECT_SOURCE_DIR}/tests/vectors/arms")
