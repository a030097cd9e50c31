corbot_test(test_planner_property COMPUTES
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/planner/laws_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/joint_motions_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/paths_test.cpp
  LIBS corbot_planner
  LABELS property)
target_include_directories(test_planner_property PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/../unit/planner)
