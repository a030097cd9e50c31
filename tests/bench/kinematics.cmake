# Every family, beside the paper's equations.
add_executable(bench_arms ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/arm_bench.cpp)
corbot_target(bench_arms)
target_include_directories(bench_arms PRIVATE ${PROJECT_SOURCE_DIR}/tests/support ${PROJECT_SOURCE_DIR}/src)
target_link_libraries(bench_arms PRIVATE corbot_test_headers benchmark::benchmark)
set_target_properties(bench_arms PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench)

# Closed forms against Orocos KDL on the same arm.
find_package(orocos_kdl QUIET)
if(NOT orocos_kdl_FOUND)
  message(STATUS "no Orocos KDL: bench_kinematics is left out")
  return()
endif()
add_executable(bench_kinematics ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/kinematics_bench.cpp)
corbot_target(bench_kinematics)
target_include_directories(bench_kinematics SYSTEM PRIVATE ${orocos_kdl_INCLUDE_DIRS})
target_include_directories(bench_kinematics PRIVATE
  ${CMAKE_CURRENT_SOURCE_DIR}/kinematics ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests/support)
target_link_libraries(bench_kinematics PRIVATE corbot_test_headers orocos-kdl)
set_target_properties(bench_kinematics PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench)
add_executable(bench_six_axis ${CMAKE_CURRENT_SOURCE_DIR}/kinematics/six_axis_bench.cpp)
corbot_target(bench_six_axis)
target_include_directories(bench_six_axis SYSTEM PRIVATE ${orocos_kdl_INCLUDE_DIRS})
target_include_directories(bench_six_axis PRIVATE
  ${CMAKE_CURRENT_SOURCE_DIR}/kinematics ${PROJECT_SOURCE_DIR}/tests/support)
target_link_libraries(bench_six_axis PRIVATE corbot_test_headers orocos-kdl)
set_target_properties(bench_six_axis PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench)
