corbot_test(test_planner_property COMPUTES
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/planner/laws_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/joint_motions_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/paths_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/gate_test.cpp
  LIBS corbot_planner corbot::rt_core
  LABELS property)
target_include_directories(test_planner_property PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/../unit/planner)
