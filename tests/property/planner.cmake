corbot_test(test_planner_property COMPUTES
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/planner/laws_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/joint_motions_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/paths_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/gate_test.cpp
  LIBS corbot_planner corbot::rt_core
  LABELS property)
corbot_test(test_arms_paths COMPUTES
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/planner/arms_paths_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/poses_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/planner/frames_test.cpp
  LIBS corbot_planner corbot::rt_core
  LABELS property)
target_include_directories(test_arms_paths PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/../unit/planner ${PROJECT_SOURCE_DIR}/tests/support)
target_compile_definitions(test_arms_paths PRIVATE CORBOT_ARM_VECTORS="${PROJECT_SOURCE_DIR}/tests/vectors/arms")
target_include_directories(test_planner_property PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/../unit/planner ${PROJECT_SOURCE_DIR}/tests/support)
corbot_test(test_other_paths COMPUTES
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/planner/other_paths_test.cpp
  LIBS corbot_planner corbot::rt_core
  LABELS property)
target_include_directories(test_other_paths PRIVATE ${PROJECT_SOURCE_DIR}/tests/support)
target_compile_definitions(test_other_paths PRIVATE CORBOT_ARM_VECTORS="${PROJECT_SOURCE_DIR}/tests/vectors/arms")
