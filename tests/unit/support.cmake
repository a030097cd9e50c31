# SPDX-License-Identifier: Apache-2.0
corbot_test(ports_test SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/support/ports_test.cpp LIBS corbot_process)
corbot_test(giop_message_test SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/support/giop_message_test.cpp LIBS corbot_process)
if(TARGET corbot_rig)
  corbot_test(escaped_exception_test SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/support/escaped_exception_test.cpp LIBS corbot_rig)
  target_compile_definitions(escaped_exception_test PRIVATE CORBOT_IDL_DIR="${PROJECT_SOURCE_DIR}/idl")
endif()
