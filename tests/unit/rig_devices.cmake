# SPDX-License-Identifier: Apache-2.0
# Against a kernel that has the devices; skipped elsewhere, with the reason.
corbot_test(rig_devices_test
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/rig_devices/gpio_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/rig_devices/pwm_test.cpp
  LIBS corbot::backends
  LABELS rig)
target_include_directories(rig_devices_test PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
