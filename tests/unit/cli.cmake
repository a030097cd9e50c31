# SPDX-License-Identifier: Apache-2.0
if(TARGET corbot_cli)
  corbot_test(test_cli
    SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/cli/test_numbers.cpp ${CMAKE_CURRENT_SOURCE_DIR}/cli/test_program.cpp
            ${CMAKE_CURRENT_SOURCE_DIR}/cli/test_messages.cpp ${CMAKE_CURRENT_SOURCE_DIR}/cli/test_state.cpp
            ${CMAKE_CURRENT_SOURCE_DIR}/cli/test_doctor.cpp ${CMAKE_CURRENT_SOURCE_DIR}/cli/test_views.cpp
            ${CMAKE_CURRENT_SOURCE_DIR}/cli/test_calibration.cpp
    LIBS corbot::cli fmt::fmt)
  target_compile_definitions(test_cli PRIVATE CORBOT_EXAMPLES="${PROJECT_SOURCE_DIR}/examples"
                                              CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles")
endif()
