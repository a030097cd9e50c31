# Time laws against Ruckig, whose sources PyPI carries: pip download --no-binary :all: --no-deps ruckig,
# unpack, and set CORBOT_RUCKIG_DIR to where CMakeLists.txt lies. Without it only corbot's own times are
# measured.
set(CORBOT_RUCKIG_DIR "" CACHE PATH "Unpacked sources of Ruckig, empty for none")
add_executable(bench_planner ${CMAKE_CURRENT_SOURCE_DIR}/planner/planner_bench.cpp)
corbot_target(bench_planner)
target_include_directories(bench_planner PRIVATE
  ${CMAKE_CURRENT_SOURCE_DIR}/kinematics ${CMAKE_CURRENT_SOURCE_DIR}/../unit/planner
  ${PROJECT_SOURCE_DIR}/tests/support)
target_link_libraries(bench_planner PRIVATE corbot_test_headers corbot::planner corbot::config)
set_target_properties(bench_planner PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench)
# The program whose output tests/bench/planner/toppra_bench.py compares with toppra. It lies in a directory of
# its own, as it prints numbers for that script alone.
find_package(nlohmann_json REQUIRED)
add_executable(path_times ${CMAKE_CURRENT_SOURCE_DIR}/planner/path_times.cpp)
corbot_target(path_times)
target_include_directories(path_times PRIVATE
  ${CMAKE_CURRENT_SOURCE_DIR}/kinematics ${CMAKE_CURRENT_SOURCE_DIR}/../unit/planner
  ${PROJECT_SOURCE_DIR}/tests/support)
target_link_libraries(path_times PRIVATE corbot_test_headers corbot::planner corbot::config
                                         nlohmann_json::nlohmann_json)
set_target_properties(path_times PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench/toppra)
if(CORBOT_RUCKIG_DIR)
  file(GLOB ruckig_sources ${CORBOT_RUCKIG_DIR}/src/ruckig/*.cpp)
  list(FILTER ruckig_sources EXCLUDE REGEX "cloud_client|python|module")
  add_library(bench_ruckig STATIC ${ruckig_sources})
  target_include_directories(bench_ruckig SYSTEM PUBLIC ${CORBOT_RUCKIG_DIR}/include)
  target_link_libraries(bench_planner PRIVATE corbot_test_headers bench_ruckig)
  target_compile_definitions(bench_planner PRIVATE CORBOT_HAS_RUCKIG)
endif()
