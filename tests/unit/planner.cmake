corbot_test(test_planner
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/planner/refusals_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/motions_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/path_proof_test.cpp
  LIBS corbot_planner
  LABELS unit)
