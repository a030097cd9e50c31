# SPDX-License-Identifier: Apache-2.0
set(here ${CMAKE_CURRENT_SOURCE_DIR}/backends)
corbot_test(backends_test
  SOURCES ${here}/encoding_test.cpp ${here}/bus_approach_test.cpp ${here}/bus_backend_test.cpp ${here}/bus_standby_test.cpp
          ${here}/bus_standstill_test.cpp ${here}/bus_way_test.cpp
          ${here}/gpiod_test.cpp ${here}/pca9685_test.cpp ${here}/pwm_sysfs_test.cpp ${here}/serial_arrival_test.cpp
          ${here}/serial_controllers_test.cpp ${here}/serial_port_test.cpp ${here}/stop_input_test.cpp
  LIBS corbot::backends corbot::inputs corbot::sim_devices)
target_compile_definitions(backends_test PRIVATE CORBOT_SCRATCH_DIR="${CMAKE_BINARY_DIR}/tests")
target_include_directories(backends_test PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/tests)
