# GPIO lines. All of it but the chip itself is built everywhere, and tested. drivers/CMakeLists.txt includes it.
option(POSED_GPIO "Status light, enable input and camera trigger on GPIO lines" ON)
if(POSED_GPIO)
  # Version 2 of libgpiod has another interface.
  pkg_check_modules(GPIOD IMPORTED_TARGET libgpiod>=1.6 libgpiod<2)
  if(NOT GPIOD_FOUND)
    message(STATUS "No libgpiod 1.6 (libgpiod-dev): built without GPIO lines (POSED_GPIO)")
    set(POSED_GPIO OFF CACHE BOOL "Status light, enable input and camera trigger on GPIO lines" FORCE)
  endif()
endif()
target_sources(posed_drivers PRIVATE
  gpio_lines.cpp gpio/blink_pattern.cpp gpio/enable_input.cpp gpio/gpio_thread.cpp gpio/gpio_worker.cpp gpio/held_line.cpp
  gpio/status_light.cpp gpio/trigger_output.cpp)
if(POSED_GPIO)
  target_sources(posed_drivers PRIVATE gpio/libgpiod_access.cpp)
  target_link_libraries(posed_drivers PRIVATE PkgConfig::GPIOD)
  target_compile_definitions(posed_drivers PUBLIC POSED_HAS_GPIO)
endif()
