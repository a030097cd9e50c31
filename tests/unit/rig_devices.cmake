# SPDX-License-Identifier: Apache-2.0
# Against a kernel that has the devices; skipped elsewhere, with the reason.
corbot_test(rig_devices_test TIER process
  SOURCES rig_devices/gpio_test.cpp rig_devices/pwm_test.cpp
  LIBS corbot::backends corbot::inputs)

# The GPIO tests once more on libgpiod 2, which Debian 12 has not; its Python binding on PyPI carries the
# sources.
set(CORBOT_LIBGPIOD2_DIR "" CACHE PATH "Unpacked sources of PyPI's gpiod 2, empty for none")
if(EXISTS "${CORBOT_LIBGPIOD2_DIR}/libgpiod-version.txt")
  file(GLOB libgpiod2_sources ${CORBOT_LIBGPIOD2_DIR}/lib/*.c)
  file(READ ${CORBOT_LIBGPIOD2_DIR}/libgpiod-version.txt libgpiod2_version)
  add_library(gpiod2 STATIC ${libgpiod2_sources})
  target_include_directories(gpiod2 SYSTEM PUBLIC ${CORBOT_LIBGPIOD2_DIR}/include)
  target_compile_definitions(gpiod2 PRIVATE _GNU_SOURCE GPIOD_VERSION_STR="${libgpiod2_version}")
  add_library(corbot_gpio2 STATIC ${PROJECT_SOURCE_DIR}/rt/backends/gpio/gpio_lines_v2.cpp)
  corbot_target(corbot_gpio2)
  target_include_directories(corbot_gpio2 PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(corbot_gpio2 PRIVATE gpiod2)
  # Only the rig runs it. First in the linker's order: what it defines is not looked for in corbot::gpio.
  add_executable(rig_gpiod2_test ${CMAKE_CURRENT_SOURCE_DIR}/rig_devices/gpio_test.cpp)
  corbot_target(rig_gpiod2_test)
  target_link_libraries(rig_gpiod2_test PRIVATE corbot_test_headers corbot_gpio2 corbot::backends
                                                corbot::inputs GTest::gtest GTest::gmock GTest::gtest_main)
  set_target_properties(rig_gpiod2_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
endif()
