# SPDX-License-Identifier: Apache-2.0
corbot_test(backends_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/backends/encoding_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/backends/bus_backend_test.cpp
  LIBS corbot::backends)
