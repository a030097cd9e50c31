corbot_test(test_kinematics_property COMPUTES
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/pitch_round_trip_test.cpp
  LABELS property)
target_include_directories(test_kinematics_property PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests/support)
# A family's own file is found by itself.
file(GLOB poses CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/poses/*_test.cpp)
corbot_test(test_arm_round_trip COMPUTES
  SOURCES ${poses}
  LABELS property)
corbot_test(test_path_form COMPUTES
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/path_form_test.cpp
  LABELS property)
