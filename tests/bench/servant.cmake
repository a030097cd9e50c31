# Attribute read through the servant against a bare omniORB echo of the same size, alternating in one run.
if(NOT OMNIORB_FOUND)
  return()
endif()
set(echo_gen ${CMAKE_CURRENT_BINARY_DIR}/echo)
file(MAKE_DIRECTORY ${echo_gen})
add_custom_command(OUTPUT ${echo_gen}/echoSK.cc ${echo_gen}/echo.hh
  COMMAND omniidl -bcxx -Wbh=.hh -Wbs=SK.cc -C${echo_gen} ${CMAKE_CURRENT_SOURCE_DIR}/echo.idl
  DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/echo.idl VERBATIM)
add_library(bench_echo_idl STATIC ${echo_gen}/echoSK.cc)
target_include_directories(bench_echo_idl SYSTEM PUBLIC ${echo_gen})
target_link_libraries(bench_echo_idl PUBLIC PkgConfig::OMNIORB)

add_executable(bench_echo_server ${CMAKE_CURRENT_SOURCE_DIR}/servant/echo_server.cpp)
add_executable(bench_servant ${CMAKE_CURRENT_SOURCE_DIR}/servant/servant_bench.cpp)
foreach(program IN ITEMS bench_echo_server bench_servant)
  corbot_target(${program})
  target_link_libraries(${program} PRIVATE corbot_test_headers bench_echo_idl corbot::idl fmt::fmt)
  set_target_properties(${program} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench)
endforeach()
add_dependencies(bench_servant bench_echo_server)
