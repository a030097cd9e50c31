# SPDX-License-Identifier: Apache-2.0
corbot_test(net_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/net/arrivals_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/net/connections_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/net/places_test.cpp
  LIBS corbot::net corbot_process
  LABELS unit)
target_include_directories(net_test PRIVATE ${CMAKE_SOURCE_DIR}/src ${CMAKE_SOURCE_DIR}/tests)
