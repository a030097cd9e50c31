# SPDX-License-Identifier: Apache-2.0
set(here ${CMAKE_CURRENT_SOURCE_DIR}/cell_scene)
corbot_test(sim_scene_test
  SOURCES ${here}/arm_body_test.cpp ${here}/capsule_test.cpp ${here}/pieces_test.cpp ${here}/servo_socket_test.cpp
  LIBS corbot::sim_scene corbot::config corbot::backends
  LABELS unit)
target_include_directories(sim_scene_test PRIVATE ${PROJECT_SOURCE_DIR}/tests)
target_compile_definitions(sim_scene_test PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles"
                                                  CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")
if(TARGET corbot_cell_scene)
  corbot_test(cell_scene_test
    SOURCES ${here}/scene_test.cpp
    LIBS corbot::cell_scene corbot::backends
    LABELS unit)
  target_include_directories(cell_scene_test PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_compile_definitions(cell_scene_test PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles"
                                                     CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")
endif()
if(TARGET corbot-scene AND TARGET corbot AND TARGET corbot-servant)
  corbot_test(cell_scene_program_test
    SOURCES ${here}/scene_program_test.cpp
    LIBS corbot_cli_rig corbot::cell_config fmt::fmt
    LABELS interop
    DEPENDS corbot corbot-rt corbot-servant corbot-scene)
  target_compile_definitions(cell_scene_program_test PRIVATE CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles")
endif()
