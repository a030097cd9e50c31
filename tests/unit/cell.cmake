# SPDX-License-Identifier: Apache-2.0
if(TARGET corbot_cell_config)
  corbot_test(unit_cell_config
    SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/cell/config_test.cpp
    LIBS corbot::cell_config fmt::fmt
    LABELS unit)
  target_compile_definitions(unit_cell_config PRIVATE CORBOT_CELL="${PROJECT_SOURCE_DIR}/profiles/cell")
endif()
if(TARGET corbot_cli)
  corbot_test(unit_cell_verdict
    SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/cell/verdict_test.cpp
    LIBS corbot::cli fmt::fmt
    LABELS unit)
  target_compile_definitions(unit_cell_verdict PRIVATE CORBOT_CELL="${PROJECT_SOURCE_DIR}/profiles/cell")
endif()
if(TARGET corbot-store)
  corbot_test(unit_cell_program
    SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/cell/program_test.cpp
    LIBS corbot::cell_program corbot::client corbot_process fmt::fmt
    LABELS unit
    DEPENDS corbot-store)
  target_compile_definitions(unit_cell_program PRIVATE CORBOT_BIN_DIR="${CMAKE_BINARY_DIR}/bin")
endif()
