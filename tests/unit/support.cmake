# SPDX-License-Identifier: Apache-2.0
corbot_test(ports_test SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/support/ports_test.cpp LIBS corbot_process)
