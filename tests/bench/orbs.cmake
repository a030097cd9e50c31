# Both servants against a bare echo on their ORB, over TCP and Unix sockets, alternating in one run.
if(NOT OMNIORB_FOUND)
  return()
endif()
set(orbs ${CMAKE_CURRENT_SOURCE_DIR}/orbs)
add_executable(bench_orbs ${orbs}/orbs_bench.cpp ${orbs}/probe.cpp ${orbs}/servers.cpp)
add_executable(bench_orbs_omniorb_server ${orbs}/echo_omniorb.cpp)
target_include_directories(bench_orbs PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/tests)
target_compile_definitions(bench_orbs PRIVATE
  CORBOT_BIN_DIR="${CMAKE_BINARY_DIR}/bin" CORBOT_BENCH_DIR="${CMAKE_BINARY_DIR}/bench"
  CORBOT_PROFILE="${CORBOT_TEST_PROFILE}")
target_link_libraries(bench_orbs PRIVATE corbot_process corbot::idl fmt::fmt)
target_link_libraries(bench_orbs_omniorb_server PRIVATE corbot::idl)
set(orbs_programs bench_orbs bench_orbs_omniorb_server)
add_dependencies(bench_orbs bench_orbs_omniorb_server corbot-rt corbot-servant)

if(ORBIT2_FOUND)
  set(servant ${PROJECT_SOURCE_DIR}/src/orb/orbit2)
  add_executable(bench_orbs_orbit2_server ${orbs}/echo_orbit2.c ${servant}/calls.c ${servant}/control_references.c
                                          ${servant}/ior.c ${servant}/log.c ${servant}/orb.c ${servant}/raise.c
                                          ${servant}/requests.c)
  target_include_directories(bench_orbs_orbit2_server PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(bench_orbs_orbit2_server PRIVATE corbot::robot corbot::net ${CMAKE_DL_LIBS})
  corbot_on_orbit2(bench_orbs_orbit2_server)
  add_executable(bench_orbs_orbit2_client ${orbs}/client_orbit2.c)
  target_link_libraries(bench_orbs_orbit2_client PRIVATE corbot::idl_orbit2)
  target_compile_definitions(bench_orbs PRIVATE CORBOT_HAS_ORBIT2)
  list(APPEND orbs_programs bench_orbs_orbit2_server bench_orbs_orbit2_client)
  add_dependencies(bench_orbs bench_orbs_orbit2_server bench_orbs_orbit2_client corbot-servant-orbit2)
endif()
foreach(program IN LISTS orbs_programs)
  corbot_target(${program})
  set_target_properties(${program} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench)
endforeach()
