# SPDX-License-Identifier: Apache-2.0
if(NOT TARGET corbot_cell_store)
  return()
endif()
set(cell_store ${CMAKE_CURRENT_SOURCE_DIR}/cell_store)
corbot_test(cell_ledger_test
  SOURCES ${cell_store}/ledger_test.cpp ${cell_store}/ledger_file_test.cpp
          ${cell_store}/ledger_property_test.cpp
  LIBS corbot::cell_store corbot_process fmt::fmt
  LABELS unit)
target_compile_definitions(cell_ledger_test PRIVATE CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")
corbot_test(cell_store_program_test
  SOURCES ${cell_store}/store_program_test.cpp
  LIBS corbot::cell_store corbot_process
  LABELS interop
  DEPENDS corbot-store)
target_compile_definitions(cell_store_program_test PRIVATE
  CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests" CORBOT_BIN_DIR="${CMAKE_BINARY_DIR}/bin"
  CORBOT_CELL="${PROJECT_SOURCE_DIR}/profiles/cell/cell.toml")
