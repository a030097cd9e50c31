# SPDX-License-Identifier: Apache-2.0
if(TARGET corbot_client)
  set(here ${CMAKE_CURRENT_SOURCE_DIR}/client)
  corbot_test(unit_client
    SOURCES ${here}/messages_test.cpp ${here}/numbers_test.cpp
    LIBS corbot::client corbot::net fmt::fmt)
endif()
