# SPDX-License-Identifier: Apache-2.0
corbot_test(rt_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/rt/cancel_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/command_check_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/rt/cycle_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/hold_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/rt/emergency_stop_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/device_watch_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/fault_stop_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/rt/joint_ramp_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/standby_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/following_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/needs_clear_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/rt/knots_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/knot_check_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/orientation_check_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/governor_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/grip_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/path_stop_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/rt/loop_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/frames_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/rt/parts_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/first_motion_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/rt/start_position_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/servants_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rt/liveness_test.cpp
          ${CMAKE_CURRENT_SOURCE_DIR}/rt/realtime_setup_test.cpp ${PROJECT_SOURCE_DIR}/rt/realtime_setup.cpp
          ${PROJECT_SOURCE_DIR}/rt/loop.cpp ${PROJECT_SOURCE_DIR}/rt/cycle_settings.cpp ${PROJECT_SOURCE_DIR}/rt/start_position.cpp
  LIBS corbot::rt_core corbot::loopback corbot::planner corbot::config corbot::state corbot::threads spdlog::spdlog fmt::fmt)
target_include_directories(rt_test PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
target_compile_definitions(rt_test PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles"
                                           CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")

# A program of its own: it brings its own malloc.
corbot_test(rt_noalloc_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/rt/noalloc_test.cpp
  LIBS corbot::rt_core corbot::loopback corbot::planner corbot::config ${CMAKE_DL_LIBS})
target_include_directories(rt_noalloc_test PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
target_compile_definitions(rt_noalloc_test PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles")

# The cycle never calls the loader; its control is the same program, bound lazily. The sanitizers bring functions of their own.
if(NOT CORBOT_SANITIZE)
  foreach(probe IN ITEMS binding_probe binding_probe_lazy)
    add_executable(${probe} ${CMAKE_CURRENT_SOURCE_DIR}/rt/binding_probe.cpp)
    corbot_target(${probe})
    target_include_directories(${probe} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
    target_compile_definitions(${probe} PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles")
    target_link_libraries(${probe} PRIVATE corbot::rt_core corbot::loopback corbot::planner corbot::config)
    set_target_properties(${probe} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  endforeach()
  target_link_options(binding_probe_lazy PRIVATE -Wl,-z,lazy)
  corbot_test(binding_test
    SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/rt/binding_test.cpp
    LIBS corbot_process corbot::config
    DEPENDS binding_probe binding_probe_lazy)
  set(programs)
  foreach(program IN ITEMS corbot corbot-rt corbot-servant corbot-servant-orbit2 corbot-sim)
    if(TARGET ${program})
      add_dependencies(binding_test ${program})
      list(APPEND programs ${CMAKE_BINARY_DIR}/bin/${program})
    endif()
  endforeach()
  list(JOIN programs "," programs)
  target_compile_definitions(binding_test PRIVATE CORBOT_PROGRAMS="${programs}" CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles"
    CORBOT_BINDING_PROBE="$<TARGET_FILE:binding_probe>" CORBOT_BINDING_PROBE_LAZY="$<TARGET_FILE:binding_probe_lazy>")
endif()
