corbot_test(test_kinematics
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/paper_arm_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/law_evaluation_test.cpp
  LABELS unit)
corbot_test(test_arm_kinematics
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/arm_vectors_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/arm_kinematics_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/six_axis_arms_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/path_form_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/arc_tangent_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/sub_problems_test.cpp
  LABELS unit)
# A program of its own: it brings its own malloc.
corbot_test(test_kinematics_noalloc
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/kinematics_noalloc_test.cpp
  LABELS unit)
foreach(test IN ITEMS test_kinematics test_arm_kinematics test_kinematics_noalloc)
  target_include_directories(${test} PRIVATE ${PROJECT_SOURCE_DIR}/tests/support ${PROJECT_SOURCE_DIR}/src)
  target_compile_definitions(${test} PRIVATE CORBOT_ARM_VECTORS="${PROJECT_SOURCE_DIR}/tests/vectors/arms")
endforeach()
