# Tests of the ORB extractor. OpenCV's modules are references to compare with.
foreach(module features2d imgproc imgcodecs core)
  posed_find_opencv(${module})
endforeach()
set(POSED_ORB_TEST_LIBRARIES posed_slam OpenCV::features2d OpenCV::imgproc OpenCV::core)

posed_test(orb_test
  SOURCES hamming_test.cpp orb_extractor_test.cpp orb_kernels_test.cpp orb_matching_test.cpp orb_stages_test.cpp
  LIBRARIES ${POSED_ORB_TEST_LIBRARIES})
# Replaces the global operator new, hence a program of its own.
posed_test(orb_allocation_test SOURCES allocation_counter.cpp orb_allocation_test.cpp LIBRARIES ${POSED_ORB_TEST_LIBRARIES})

# No function that is compiled for a newer processor may be visible to the linker, which might take it for the baseline's.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$" AND NOT POSED_SANITIZE AND NOT POSED_COVERAGE)
  add_test(NAME orb_kernels_export_no_shared_functions COMMAND ${CMAKE_COMMAND}
    "-DNM=${CMAKE_NM}" "-DOBJECTS=$<TARGET_OBJECTS:posed_kernels_avx2>;$<TARGET_OBJECTS:posed_kernels_avx512>"
    -P "${CMAKE_CURRENT_LIST_DIR}/check_kernel_symbols.cmake")
endif()
