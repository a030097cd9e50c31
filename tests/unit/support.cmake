# SPDX-License-Identifier: Apache-2.0
corbot_test(ports_test SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/support/ports_test.cpp LIBS corbot_process)
corbot_test(giop_message_test SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/support/giop_message_test.cpp LIBS corbot_process)
