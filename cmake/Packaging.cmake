# cpack -G DEB: posed (the daemon), posed-tools (posectl), posed-dev (for subscribers).
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME posed)
set(CPACK_PACKAGE_VENDOR "The posed authors")
set(CPACK_PACKAGE_CONTACT "The posed authors <posed@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each component has its own
set(CPACK_PACKAGE_VERSION "${PROJECT_VERSION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL daemon tools dev)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEBIAN_DAEMON_PACKAGE_NAME posed)
set(CPACK_DEBIAN_DAEMON_PACKAGE_SECTION science)
set(CPACK_DEBIAN_DAEMON_PACKAGE_DEPENDS "systemd | systemd-standalone-sysusers, udev")
set(CPACK_DEBIAN_DAEMON_DESCRIPTION "Pose daemon: RGB-D SLAM that keeps moving people out of the map
posed tracks an RGB-D camera on a mobile robot, builds a map, closes loops
and publishes the pose of each frame over LCM, with its covariance. People
whom its detector finds are kept out of the geometry.")
set(CPACK_DEBIAN_DAEMON_PACKAGE_CONTROL_EXTRA
  "${PROJECT_SOURCE_DIR}/cmake/debian/postinst;${PROJECT_SOURCE_DIR}/cmake/debian/prerm;${PROJECT_SOURCE_DIR}/cmake/debian/postrm")

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME posed-tools)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS "posed (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_TOOLS_DESCRIPTION "tools for posed: record, replay, evaluate, calibrate
posectl records RGB-D cameras, replays recordings through the daemon's
pipeline, evaluates trajectories, calibrates cameras, and shows live what
the pose daemon publishes.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME posed-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "liblcm-dev")
set(CPACK_DEBIAN_DEV_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_DEV_DESCRIPTION "message types for subscribers to posed
The LCM types that the pose daemon publishes, as C++ headers with a CMake
configuration and as .lcm files for other languages, and examples of
subscribers in C++ and Python.")
include(CPack)
