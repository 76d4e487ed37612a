# posed_lcm_messages(NAME FILES ...): an interface library of the C++ classes that lcm-gen makes of the .lcm files, in the build tree.
# A file holds one struct; TYPE of `package PACKAGE` is included as <PACKAGE/TYPE.hpp>, whatever the file is called.
function(posed_lcm_messages name)
  cmake_parse_arguments(ARG "" "" "FILES" ${ARGN})
  set(generated_dir "${CMAKE_CURRENT_BINARY_DIR}/generated")
  set(headers)
  foreach(file ${ARG_FILES})
    set(path "${CMAKE_CURRENT_SOURCE_DIR}/${file}")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${path}")
    file(READ "${path}" text)
    string(REGEX MATCH "\npackage ([a-z_]+);" _ "\n${text}")
    set(package "${CMAKE_MATCH_1}")
    string(REGEX MATCH "\nstruct ([a-z_]+) {" _ "\n${text}")
    set(struct "${CMAKE_MATCH_1}")
    if(NOT package OR NOT struct)
      message(FATAL_ERROR "${path}: needs a line 'package NAME;' and a line 'struct NAME {'")
    endif()
    set(header "${generated_dir}/${package}/${struct}.hpp")
    add_custom_command(OUTPUT "${header}"
      COMMAND "${LCM_GEN}" --cpp --cpp-std=c++11 --cpp-hpath "${generated_dir}" "${path}"
      DEPENDS "${path}" VERBATIM)
    list(APPEND headers "${header}")
  endforeach()
  add_custom_target(${name}_generate DEPENDS ${headers})
  add_library(${name} INTERFACE)
  add_dependencies(${name} ${name}_generate)
  # SYSTEM: what lcm-gen writes is not held to this project's warnings.
  target_include_directories(${name} SYSTEM INTERFACE "${generated_dir}" "${LCM_INCLUDE_DIR}")
endfunction()
