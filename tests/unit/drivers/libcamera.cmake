# Cameras by libcamera, with a depth node of the V4L2 tests' kernel.
if(POSED_LIBCAMERA)
  posed_test(test_libcamera
    SOURCES libcamera/color_image_test.cpp libcamera/fake_color_camera.cpp libcamera/libcamera_camera_test.cpp
            libcamera/libcamera_controls_test.cpp libcamera/libcamera_faults_test.cpp libcamera/libcamera_machine_test.cpp
            libcamera/libcamera_thread_test.cpp libcamera/sensor_stamps_test.cpp
    LIBRARIES fake_v4l2 posed_drivers posed_core PkgConfig::LIBCAMERA PkgConfig::TURBOJPEG fmt::fmt)
endif()
