# SPDX-License-Identifier: Apache-2.0
if(TARGET corbot_cli)
  set(here ${CMAKE_CURRENT_SOURCE_DIR}/cli)
  corbot_test(test_cli
    SOURCES ${here}/program_test.cpp ${here}/state_test.cpp ${here}/doctor_test.cpp ${here}/views_test.cpp
            ${here}/calibration_test.cpp
    LIBS corbot::cli fmt::fmt)
  target_compile_definitions(test_cli PRIVATE CORBOT_EXAMPLES="${PROJECT_SOURCE_DIR}/examples"
                                              CORBOT_PROFILES="${PROJECT_SOURCE_DIR}/profiles")
endif()
