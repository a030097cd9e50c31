corbot_test(test_kinematics
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/kinematics_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/law_evaluation_test.cpp
  LABELS unit)
