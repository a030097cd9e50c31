# SPDX-License-Identifier: Apache-2.0
# The first program tests the cell's rooms that have threads or that read bytes of others, the second one the
# other rooms, each in one process. The third one tests each program of the cell.
if(NOT TARGET corbot_cell_store OR NOT TARGET corbot-scene)
  return()
endif()
set(clients_REGEX "(client|gantt|progress|run_table|status|verdict)_test")  # in test_clients
set(parts_REGEX "(program|coordinator|remote_robot)_test")
corbot_sources(sources cell cell_camera cell_pictures cell_scene cell_store cell_worker)
list(FILTER sources EXCLUDE REGEX ${clients_REGEX})
set(programs ${sources})
list(FILTER sources EXCLUDE REGEX ${parts_REGEX})
list(FILTER programs INCLUDE REGEX ${parts_REGEX})
set(first_REGEX "/cell_(store|worker)/|/(activity|config|scene|scene_record|servo_socket)_test")
set(models ${sources})
list(FILTER sources INCLUDE REGEX ${first_REGEX})
list(FILTER models EXCLUDE REGEX ${first_REGEX})
corbot_test(test_cell TIER core THREADS
  SOURCES ${sources} cell_worker/fake_cell.cpp
  LIBS corbot::cell_scene corbot::cell_store corbot::cell_worker corbot::cell_config corbot::sim_scene
       corbot::config corbot::backends corbot_process corbot_escapes fmt::fmt)
corbot_test(test_cell_models TIER core SANITIZED_AT_NIGHT
  SOURCES ${models}
  LIBS corbot::cell_pictures corbot::cell_scene corbot::cell_config corbot::sim_scene corbot::config
       corbot::backends corbot_process tinyxml fmt::fmt)
corbot_test(test_cell_programs TIER process
  SOURCES ${programs} cell_worker/fake_cell.cpp
  LIBS corbot_cli_rig corbot::cell_coordinator corbot::cell_worker corbot::cell_store corbot::cell_program
       corbot::cell_config corbot::cell_record corbot::client corbot_rig fmt::fmt
  DEPENDS corbot corbot-rt corbot-servant corbot-store corbot-scene corbot-camera)
