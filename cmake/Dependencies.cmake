# Everything the daemon needs from outside, all of it in Debian 12; docs/dependencies.md says what each is for.
include(CheckIncludeFileCXX)
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
find_package(tl-expected QUIET)
if(NOT TARGET tl::expected)
  find_path(TL_EXPECTED_INCLUDE_DIR tl/expected.hpp REQUIRED)
  add_library(tl::expected INTERFACE IMPORTED)
  target_include_directories(tl::expected INTERFACE "${TL_EXPECTED_INCLUDE_DIR}")
endif()
pkg_check_modules(TOMLPP REQUIRED IMPORTED_TARGET tomlplusplus)
pkg_check_modules(SPNG REQUIRED IMPORTED_TARGET spng)
pkg_check_modules(TURBOJPEG REQUIRED IMPORTED_TARGET libturbojpeg)
# lcm.pc asks for GLib's development files, which nothing of LCM's headers needs.
find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp REQUIRED)
find_library(LCM_LIBRARY lcm REQUIRED)
add_library(lcm::lcm UNKNOWN IMPORTED)
set_target_properties(lcm::lcm PROPERTIES IMPORTED_LOCATION "${LCM_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${LCM_INCLUDE_DIR}")
pkg_check_modules(SYSTEMD REQUIRED IMPORTED_TARGET libsystemd)
find_program(LCM_GEN lcm-gen REQUIRED)

# The detector. oneDNN's own CMake configuration asks for OpenCL's development files, which nothing here needs; the ONNX library has
# the classes of the format's messages, all that is used of it.
find_path(DNNL_INCLUDE_DIR oneapi/dnnl/dnnl.hpp REQUIRED)
find_library(DNNL_LIBRARY dnnl REQUIRED)
add_library(dnnl::dnnl UNKNOWN IMPORTED)
set_target_properties(dnnl::dnnl PROPERTIES IMPORTED_LOCATION "${DNNL_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${DNNL_INCLUDE_DIR}")
find_path(ONNX_INCLUDE_DIR onnx/onnx_pb.h REQUIRED)
find_library(ONNX_PROTO_LIBRARY onnx_proto REQUIRED)
pkg_check_modules(PROTOBUF REQUIRED IMPORTED_TARGET protobuf)
add_library(onnx::proto UNKNOWN IMPORTED)
set_target_properties(onnx::proto PROPERTIES
  IMPORTED_LOCATION "${ONNX_PROTO_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${ONNX_INCLUDE_DIR}"
  INTERFACE_COMPILE_DEFINITIONS "ONNX_ML=1;ONNX_NAMESPACE=onnx" INTERFACE_LINK_LIBRARIES PkgConfig::PROTOBUF)

# Debian puts OpenCV's CMake configuration into the package of all modules, which pulls in Qt, VTK and GDAL; the core module with its
# universal intrinsics is all that the daemon needs, so it is found by hand.
find_path(OPENCV_INCLUDE_DIR opencv2/core/hal/intrin.hpp PATH_SUFFIXES opencv4 REQUIRED)
function(posed_find_opencv module)
  if(NOT TARGET OpenCV::${module})
    find_library(OPENCV_${module}_LIBRARY opencv_${module} REQUIRED)
    add_library(OpenCV::${module} UNKNOWN IMPORTED)
    set_target_properties(OpenCV::${module} PROPERTIES
      IMPORTED_LOCATION "${OPENCV_${module}_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${OPENCV_INCLUDE_DIR}")
  endif()
endfunction()
posed_find_opencv(core)

# Cameras by OpenNI2.
option(POSED_OPENNI2 "Cameras by OpenNI2 (libopenni2-dev)" ON)
set(POSED_HAS_OPENNI2 OFF)
if(POSED_OPENNI2)
  find_path(OPENNI2_INCLUDE_DIR OpenNI.h PATH_SUFFIXES openni2)
  find_library(OPENNI2_LIBRARY OpenNI2)
  if(OPENNI2_INCLUDE_DIR AND OPENNI2_LIBRARY)
    set(POSED_HAS_OPENNI2 ON)
    add_library(openni2::openni2 UNKNOWN IMPORTED)
    set_target_properties(openni2::openni2 PROPERTIES
      IMPORTED_LOCATION "${OPENNI2_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${OPENNI2_INCLUDE_DIR}")
  else()
    message(WARNING "Without cameras by OpenNI2: libopenni2-dev is not installed. POSED_OPENNI2=OFF silences this.")
  endif()
endif()
