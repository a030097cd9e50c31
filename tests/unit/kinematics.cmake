corbot_test(test_kinematics
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/kinematics_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/law_evaluation_test.cpp
  LABELS unit)
corbot_test(test_arm_kinematics
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/arm_vectors_test.cpp
  LABELS unit)
target_include_directories(test_arm_kinematics PRIVATE ${PROJECT_SOURCE_DIR}/tests/support)
target_compile_definitions(test_arm_kinematics PRIVATE CORBOT_ARM_VECTORS="${PROJECT_SOURCE_DIR}/tests/vectors/arms")
