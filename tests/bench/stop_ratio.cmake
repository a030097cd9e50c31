# The program whose output tests/bench/planner/stop_ratio.py compares with the shortest stops. It lies in a
# directory of its own, as it prints numbers for that script alone.
find_package(nlohmann_json REQUIRED)
add_executable(stop_states ${CMAKE_CURRENT_SOURCE_DIR}/planner/stop_states.cpp)
corbot_target(stop_states)
target_include_directories(stop_states PRIVATE ${PROJECT_SOURCE_DIR}/tests/support)
target_link_libraries(stop_states PRIVATE corbot_test_headers corbot::rt_core corbot::planner corbot::config
                                          nlohmann_json::nlohmann_json)
set_target_properties(stop_states PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench/stops)
