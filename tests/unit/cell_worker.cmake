# SPDX-License-Identifier: Apache-2.0
if(TARGET corbot_cell_worker)
  set(here ${CMAKE_CURRENT_SOURCE_DIR}/cell_worker)
  corbot_test(cell_worker_test
    SOURCES ${here}/fake_cell.cpp ${here}/process_name_test.cpp ${here}/worker_test.cpp
    LIBS corbot::cell_worker fmt::fmt
    LABELS unit)
  target_include_directories(cell_worker_test PRIVATE ${CMAKE_SOURCE_DIR}/tests)
endif()
if(TARGET corbot_cell_remote)
  corbot_test(cell_remote_test
    SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/cell_worker/remote_robot_test.cpp
    LIBS corbot::cell_remote corbot_rig fmt::fmt
    LABELS interop
    DEPENDS corbot-rt corbot-servant)
endif()
if(TARGET corbot_cell_coordinator)
  corbot_test(cell_coordinator_test
    SOURCES ${here}/coordinator_test.cpp ${here}/fake_cell.cpp
    LIBS corbot::cell_coordinator corbot::cell_worker corbot_rig fmt::fmt
    LABELS interop
    DEPENDS corbot-rt corbot-servant)
  target_include_directories(cell_coordinator_test PRIVATE ${CMAKE_SOURCE_DIR}/tests)
endif()
