corbot_test(channel_test COMPUTES
  SOURCES
    ${CMAKE_CURRENT_SOURCE_DIR}/channel/ring_test.cpp
    ${CMAKE_CURRENT_SOURCE_DIR}/channel/ring_ends_test.cpp
    ${CMAKE_CURRENT_SOURCE_DIR}/channel/snapshot_cell_test.cpp
    ${CMAKE_CURRENT_SOURCE_DIR}/channel/stop_test.cpp
    ${CMAKE_CURRENT_SOURCE_DIR}/channel/trace_test.cpp
    ${CMAKE_CURRENT_SOURCE_DIR}/channel/fingerprint_test.cpp
    ${CMAKE_CURRENT_SOURCE_DIR}/channel/wake_test.cpp
    ${CMAKE_CURRENT_SOURCE_DIR}/channel/segment_test.cpp
    ${CMAKE_CURRENT_SOURCE_DIR}/channel/meeting_test.cpp
    ${CMAKE_CURRENT_SOURCE_DIR}/channel/hostile_test.cpp
  LIBS corbot::shm
  LABELS unit)

corbot_test(channel_stress_test COMPUTES
  SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/channel/stress_test.cpp
  LABELS unit TIMEOUT 300)

# The stress test's broken variants: each must make ThreadSanitizer report a data race, or the sanitizer proves nothing.
add_executable(channel_weak_order ${CMAKE_CURRENT_SOURCE_DIR}/channel/weak_order.cpp)
corbot_target(channel_weak_order)
add_dependencies(corbot_tsan_tests channel_weak_order)
set_target_properties(channel_weak_order PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
foreach(variant IN ITEMS right relaxed_publish relaxed_take relaxed_free relaxed_reuse relaxed_sequence)
  add_test(NAME channel_weak_order.${variant}
           COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/channel/expect_race.sh $<TARGET_FILE:channel_weak_order> ${variant})
  set_tests_properties(channel_weak_order.${variant} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 120 LABELS unit)
endforeach()
