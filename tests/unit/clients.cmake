# SPDX-License-Identifier: Apache-2.0
# The first program tests what clients share in one process, the second one the command line with what it
# starts. The command line takes a sixth of the time of the address sanitizer's build.
corbot_sources(sources support)
if(TARGET corbot_client)
  corbot_sources(clients client)
  list(FILTER clients EXCLUDE REGEX stop_on_signal)
  list(APPEND sources ${clients} cell/client_test.cpp cell/gantt_test.cpp cell/progress_test.cpp
       cell/run_table_test.cpp cell/status_test.cpp cell/verdict_test.cpp)
endif()
corbot_test(test_clients TIER core SANITIZED_AT_NIGHT
  SOURCES ${sources}
  LIBS corbot_process corbot::net fmt::fmt $<$<TARGET_EXISTS:corbot_cli>:corbot::cli>
       $<$<TARGET_EXISTS:corbot_escapes>:corbot_escapes>)
if(NOT TARGET corbot_cli)
  return()
endif()
add_executable(notifying_child cli/notifying_child.cpp)
corbot_target(notifying_child)
target_link_libraries(notifying_child PRIVATE PkgConfig::SYSTEMD)
set_target_properties(notifying_child PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
corbot_sources(sources cli)
corbot_test(test_commands TIER process
  SOURCES ${sources} sim_devices/corbot_sim_test.cpp
  LIBS corbot::cli corbot::planner corbot::backends corbot::sim_devices corbot_process corbot_escapes
  nlohmann_json::nlohmann_json fmt::fmt
  DEPENDS notifying_child corbot-rt corbot-sim)
