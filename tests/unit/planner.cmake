corbot_test(test_planner
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/planner/refusals_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/motions_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/path_proof_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/planner/soft_limits_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/poses_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/frames_test.cpp
  LIBS corbot_planner
  LABELS unit)
target_include_directories(test_planner PRIVATE ${PROJECT_SOURCE_DIR}/tests/support)
target_compile_definitions(test_planner PRIVATE CORBOT_ARM_VECTORS="${PROJECT_SOURCE_DIR}/tests/vectors/arms")
corbot_test(test_numeric_inverse COMPUTES
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/planner/numeric_inverse_test.cpp
  LIBS corbot_planner
  LABELS unit)
target_include_directories(test_numeric_inverse PRIVATE ${PROJECT_SOURCE_DIR}/tests/support)
target_compile_definitions(test_numeric_inverse PRIVATE CORBOT_ARM_VECTORS="${PROJECT_SOURCE_DIR}/tests/vectors/arms")
