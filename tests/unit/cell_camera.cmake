# SPDX-License-Identifier: Apache-2.0
if(NOT TARGET corbot::cell_config)
  return()
endif()
corbot_test(unit_cell_camera
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/cell_camera/camera_model_test.cpp
  LIBS corbot::cell_config
  LABELS unit)
target_compile_definitions(unit_cell_camera PRIVATE CORBOT_ARM_VECTORS="${PROJECT_SOURCE_DIR}/tests/vectors/cell")
target_include_directories(unit_cell_camera PRIVATE ${PROJECT_SOURCE_DIR}/tests)
