# SPDX-License-Identifier: Apache-2.0
# The panel in one process: its robots are fakes, its browsers are clients on the loopback.
if(NOT TARGET corbot_panel)
  return()
endif()
find_package(Boost 1.74 REQUIRED)
corbot_sources(sources panel)
corbot_test(test_panel TIER core THREADS SOURCES ${sources} LIBS corbot::panel corbot_process
  corbot_escapes Boost::headers)
