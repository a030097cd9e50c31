# SPDX-License-Identifier: Apache-2.0
# This program examines how the built programs are linked, and with what.
set(sources architecture/architecture_test.cpp architecture/linked_libraries.cpp)
# The cycle never calls the loader; its control is the same program, bound lazily. The sanitizers bring
# functions of their own.
if(NOT CORBOT_SANITIZE)
  list(APPEND sources rt/binding_test.cpp)
  add_library(binding_probe_code OBJECT rt/binding_probe.cpp)
  corbot_target(binding_probe_code)
  target_link_libraries(binding_probe_code PUBLIC corbot_test_headers corbot::rt_core corbot::loopback
                                                  corbot::planner corbot::config)
  foreach(probe IN ITEMS binding_probe binding_probe_lazy)
    add_executable(${probe})
    target_link_libraries(${probe} PRIVATE binding_probe_code)
    set_target_properties(${probe} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  endforeach()
  target_link_options(binding_probe_lazy PRIVATE -Wl,-z,lazy)
endif()
corbot_test(test_programs TIER process
  SOURCES ${sources}
  LIBS corbot_process corbot::config
  DEPENDS corbot-rt)
if(NOT CORBOT_SANITIZE)
  set(programs)
  foreach(program IN ITEMS corbot corbot-rt corbot-servant corbot-servant-orbit2 corbot-sim)
    if(TARGET ${program})
      add_dependencies(test_programs ${program})
      list(APPEND programs ${CMAKE_BINARY_DIR}/bin/${program})
    endif()
  endforeach()
  list(JOIN programs "," programs)
  target_compile_definitions(test_programs PRIVATE CORBOT_PROGRAMS="${programs}")
  add_dependencies(test_programs binding_probe binding_probe_lazy)
endif()
# The committed pictures and the script that makes them, and the words; no program is needed.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
if(NOT CORBOT_SANITIZE)
  corbot_command_test(Pictures TIER core
    COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/architecture/pictures_test.py
    PROPERTIES TIMEOUT 300)
  corbot_command_test(Words TIER core
    COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/architecture/words_test.py
    PROPERTIES TIMEOUT 300)
  corbot_command_test(Scripts TIER core
    COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/architecture/scripts_test.py
    PROPERTIES TIMEOUT 300)
  corbot_command_test(Tiers TIER core
    COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/architecture/tiers_test.py ${CMAKE_COMMAND}
    PROPERTIES TIMEOUT 300)
endif()
if(TARGET corbot AND TARGET corbot-servant AND NOT CORBOT_SANITIZE)
  corbot_command_test(Promises TIER core
    COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/architecture/promises_test.py
            ${CMAKE_CTEST_COMMAND} ${CMAKE_BINARY_DIR} ${PROJECT_SOURCE_DIR}/docs/safety.md
    PROPERTIES TIMEOUT 300)
endif()
if(TARGET corbot)
  corbot_command_test(Commands TIER process
    COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/architecture/commands_test.py
            $<TARGET_FILE:corbot>
    PROPERTIES TIMEOUT 300)
endif()
corbot_command_test(Installation TIER process
  COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/architecture/install_test.py
          ${CMAKE_COMMAND} ${CMAKE_BINARY_DIR}
  PROPERTIES TIMEOUT 300)
