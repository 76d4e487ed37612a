# shellcheck shell=bash disable=SC2034  # the lists are read by the scripts that source this file
# The Debian 12 packages of the project, in one place, as "package|purpose". docs/dependencies.md tells more of each;
# tools/lib/check_packages.sh holds the two equal.

posed_build_packages=(
  "g++|C++20 compiler"
  "cmake|build system"
  "ninja-build|build system"
  "pkg-config|finds libraries"
  "libopencv-core-dev|image type and universal intrinsics (SIMD)"
  "libeigen3-dev|linear algebra"
  "libspng-dev|PNG decoding and encoding"
  "libturbojpeg0-dev|JPEG decoding"
  "liblcm-dev|LCM, the message transport"
  "liblcm-bin|lcm-gen, the message compiler"
  "libexpected-dev|tl::expected, errors as values"
  "libspdlog-dev|logging"
  "libfmt-dev|text formatting"
  "libtomlplusplus-dev|TOML configuration files"
  "libcli11-dev|command lines"
  "libsystemd-dev|event loop and service notification"
  "nlohmann-json3-dev|JSON statistics, metadata of networks"
  "libdnnl-dev|oneDNN, the detector's network primitives"
  "libonnx-dev|ONNX message classes"
  "libprotobuf-dev|Protocol Buffers, which ONNX files are"
  "libopencv-dnn-dev|second engine for networks"
  "libopenni2-dev|cameras by OpenNI2"
  "libcamera-dev|colour cameras by libcamera"
  "libgpiod-dev|GPIO lines: status light, enable input, trigger"
)

posed_demo_packages=(
  "iproute2|ip, to look for a multicast route"
)

posed_package_packages=(
  "dpkg-dev|libraries that a Debian package depends on"
  "lintian|checks of Debian packages"
  "libopencv-calib3d-dev|posectl calibrate, which the packages have"
)

posed_fuzz_packages=(
  "clang|compiler with libFuzzer"
  "libclang-rt-14-dev|libFuzzer itself, and the sanitizers of clang"
)

posed_test_packages=(
  "libgtest-dev|unit tests"
  "libgmock-dev|matchers and mocks"
  "librapidcheck-dev|property tests"
  "libbenchmark-dev|benchmarks"
  "libceres-dev|reference solver in tests and benchmarks"
  "libopencv-imgproc-dev|reference image operations in tests"
  "libopencv-features2d-dev|reference ORB in tests and benchmarks"
  "libopencv-imgcodecs-dev|reference image files in tests"
  "libumockdev-dev|a GPIO chip for tests, below libgpiod"
  "umockdev|what libumockdev puts below a program"
  "python3|reports and reference computations of tests"
  "python3-numpy|reference computations of tests"
  "python3-torch|tests of the training code"
  "python3-opencv|tests of the training code"
  "python3-onnx|tests of the training code"
  "iproute2|network namespaces for the message tests"
  "systemd|checks of the service's unit"
)

# Installed by `tools/test --vm` alone.
posed_vm_packages=(
  "qemu-system-x86|emulates the virtual machine"
  "mmdebstrap|makes its Debian system"
  "e2fsprogs|makes its disk"
  "busybox-static|its first program"
  "cpio|its initial file system"
  "kmod|sorts its kernel modules"
  "make|compiles kernel modules"
  "libelf1|used by the kernel's tools that compile modules"
  "xz-utils|unpacks the kernel's source"
  "python3|unpacks the kernel"
)
