foreach(module features2d imgproc imgcodecs core)
  posed_find_opencv(${module})
endforeach()
posed_benchmark(orb_bench SOURCES orb_bench.cpp
  LIBRARIES posed_slam OpenCV::features2d OpenCV::imgcodecs OpenCV::imgproc OpenCV::core)
target_compile_definitions(orb_bench PRIVATE POSED_SOURCE_DIR="${PROJECT_SOURCE_DIR}")

add_executable(orb_matching orb_matching.cpp)
target_link_libraries(orb_matching PRIVATE posed_slam OpenCV::features2d OpenCV::imgcodecs OpenCV::core)
