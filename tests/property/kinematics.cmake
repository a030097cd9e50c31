corbot_test(test_kinematics_property COMPUTES
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/round_trip_test.cpp
  LABELS property)
corbot_test(test_arm_round_trip COMPUTES
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/arm_round_trip_test.cpp
  LABELS property)
