# SPDX-License-Identifier: Apache-2.0
corbot_test(architecture_test SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/architecture/architecture_test.cpp
            ${CMAKE_CURRENT_SOURCE_DIR}/architecture/linked_libraries.cpp
            LIBS corbot_process DEPENDS corbot-rt)
target_include_directories(architecture_test PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
target_compile_definitions(architecture_test PRIVATE CORBOT_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
                                                     CORBOT_RT_PROGRAM="$<TARGET_FILE:corbot-rt>")
