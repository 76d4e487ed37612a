# Sources of the ORB extractor and the Hamming distances. The kernels are compiled once for each instruction set (slam/kernels/simd.h);
# slam/CMakeLists.txt links POSED_ORB_KERNEL_OBJECTS into posed_slam.
set(POSED_ORB_SOURCES hamming.cpp kernels/orb_dispatch.cpp orb_corners.cpp orb_extractor.cpp orb_pattern.cpp orb_pyramid.cpp orb_quadtree.cpp)
set(POSED_ORB_KERNEL_SOURCES kernels/hamming_kernels.cpp kernels/orb_kernels.cpp)

# posed_kernels(LEVEL FLAGS ...): the kernel sources for one instruction set. They are hot, so also development builds optimise them.
function(posed_kernels level)
  add_library(posed_kernels_${level} OBJECT ${POSED_ORB_KERNEL_SOURCES})
  target_link_libraries(posed_kernels_${level} PRIVATE posed_options Eigen3::Eigen)
  target_include_directories(posed_kernels_${level} SYSTEM PRIVATE "${OPENCV_INCLUDE_DIR}")
  target_compile_options(posed_kernels_${level} PRIVATE -O3 ${ARGN})
endfunction()

posed_kernels(baseline)
set(POSED_ORB_KERNEL_OBJECTS $<TARGET_OBJECTS:posed_kernels_baseline>)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  posed_kernels(avx2 -mavx2 -mbmi -mpopcnt)
  # gcc 12 takes the undefined vectors inside its own AVX-512 headers for a mistake (GCC bug 105593).
  posed_kernels(avx512 -Wno-uninitialized $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized> -mavx2 -mbmi -mpopcnt -mavx512f -mavx512bw -mavx512cd -mavx512dq -mavx512vl)
  foreach(level avx2 avx512)
    list(APPEND POSED_ORB_KERNEL_OBJECTS $<TARGET_OBJECTS:posed_kernels_${level}>)
  endforeach()
endif()

# On demand; see its first lines. It reads image files with OpenCV, whose packages for that only the tests install.
function(posed_orb_pattern_tool)
  if(NOT POSED_TESTS)
    return()
  endif()
  foreach(module core imgcodecs imgproc)
    posed_find_opencv(${module})
  endforeach()
  add_executable(learn_orb_pattern EXCLUDE_FROM_ALL learn_orb_pattern.cpp)
  target_link_libraries(learn_orb_pattern PRIVATE posed_slam OpenCV::imgcodecs OpenCV::imgproc OpenCV::core)
endfunction()
