# What is installed, by component: `daemon` (package posed), `tools` (posed-tools), `dev` (posed-dev). Programs,
# configuration and models have their rules beside their targets; this is the rest.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Debian 12 has units and rules in /lib, which an installation to /usr must name absolutely.
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  set(system_lib_dir "/lib")
else()
  set(system_lib_dir "lib")
endif()
set(POSED_UNIT_DIR "${system_lib_dir}/systemd/system" CACHE STRING "Where systemd's units go")
set(POSED_UDEV_DIR "${system_lib_dir}/udev/rules.d" CACHE STRING "Where udev's rules go")

configure_file("${PROJECT_SOURCE_DIR}/systemd/posed.service.in" "${PROJECT_BINARY_DIR}/systemd/posed.service" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/systemd/posed.service" DESTINATION "${POSED_UNIT_DIR}" COMPONENT daemon)
install(FILES "${PROJECT_SOURCE_DIR}/systemd/posed.udev" DESTINATION "${POSED_UDEV_DIR}" RENAME 60-posed.rules COMPONENT daemon)
install(FILES "${PROJECT_SOURCE_DIR}/systemd/posed.sysusers" DESTINATION lib/sysusers.d RENAME posed.conf COMPONENT daemon)
install(FILES "${PROJECT_SOURCE_DIR}/systemd/posed.sysctl" DESTINATION lib/sysctl.d RENAME 30-posed.conf COMPONENT daemon)

# Compressed as Debian wants it, without a time in it, so that two builds give the same file.
function(posed_install_gzipped source destination name component)
  set(output "${PROJECT_BINARY_DIR}/packaging/${component}/${name}.gz")
  get_filename_component(folder "${output}" DIRECTORY)
  file(MAKE_DIRECTORY "${folder}")
  add_custom_command(OUTPUT "${output}" COMMAND gzip -9nc "${source}" > "${output}" DEPENDS "${source}" VERBATIM)
  set_property(GLOBAL APPEND PROPERTY POSED_GZIPPED "${output}")
  install(FILES "${output}" DESTINATION "${destination}" COMPONENT "${component}")
endfunction()

configure_file("${PROJECT_SOURCE_DIR}/cmake/debian/changelog.in" "${PROJECT_BINARY_DIR}/packaging/changelog" @ONLY)
foreach(pair daemon:posed tools:posed-tools dev:posed-dev)
  string(REPLACE ":" ";" pair "${pair}")
  list(GET pair 0 component)
  list(GET pair 1 package)
  set(doc_dir "${CMAKE_INSTALL_DATAROOTDIR}/doc/${package}")
  install(FILES "${PROJECT_SOURCE_DIR}/cmake/debian/copyright" DESTINATION "${doc_dir}" COMPONENT ${component})
  posed_install_gzipped("${PROJECT_BINARY_DIR}/packaging/changelog" "${doc_dir}" changelog ${component})
endforeach()
posed_install_gzipped("${PROJECT_SOURCE_DIR}/docs/man/posed.8" "${CMAKE_INSTALL_MANDIR}/man8" posed.8 daemon)
posed_install_gzipped("${PROJECT_SOURCE_DIR}/docs/man/posectl.1" "${CMAKE_INSTALL_MANDIR}/man1" posectl.1 tools)
get_property(gzipped GLOBAL PROPERTY POSED_GZIPPED)
add_custom_target(posed_packaging ALL DEPENDS ${gzipped})
install(FILES "${PROJECT_SOURCE_DIR}/docs/configuration.md" "${PROJECT_SOURCE_DIR}/docs/operations.md" "${PROJECT_SOURCE_DIR}/docs/messages.md"
  DESTINATION "${CMAKE_INSTALL_DATAROOTDIR}/doc/posed" COMPONENT daemon)

# For subscribers: the message types, as headers and as .lcm files for other languages, and two examples.
install(DIRECTORY "${PROJECT_BINARY_DIR}/messages/generated/posed" "${PROJECT_BINARY_DIR}/messages/generated/bot_core"
  DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/posed-messages" COMPONENT dev FILES_MATCHING PATTERN "*.hpp")
install(DIRECTORY "${PROJECT_SOURCE_DIR}/messages/" DESTINATION "${CMAKE_INSTALL_DATADIR}/posed/messages" COMPONENT dev FILES_MATCHING PATTERN "*.lcm")
install(DIRECTORY "${PROJECT_SOURCE_DIR}/examples/" DESTINATION "${CMAKE_INSTALL_DATAROOTDIR}/doc/posed-dev/examples" COMPONENT dev)
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/posedConfig.cmake.in" "${PROJECT_BINARY_DIR}/posedConfig.cmake"
  INSTALL_DESTINATION "${CMAKE_INSTALL_DATADIR}/cmake/posed" PATH_VARS CMAKE_INSTALL_INCLUDEDIR)
write_basic_package_version_file("${PROJECT_BINARY_DIR}/posedConfigVersion.cmake" COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES "${PROJECT_BINARY_DIR}/posedConfig.cmake" "${PROJECT_BINARY_DIR}/posedConfigVersion.cmake"
  DESTINATION "${CMAKE_INSTALL_DATADIR}/cmake/posed" COMPONENT dev)
