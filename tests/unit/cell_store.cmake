# SPDX-License-Identifier: Apache-2.0
if(TARGET corbot_cell_store)
  corbot_test(cell_ledger_test
    SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/cell_store/ledger_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/cell_store/ledger_file_test.cpp
            ${CMAKE_CURRENT_SOURCE_DIR}/cell_store/ledger_property_test.cpp
    LIBS corbot::cell_store corbot_process fmt::fmt
    LABELS unit)
  target_compile_definitions(cell_ledger_test PRIVATE CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")
endif()
