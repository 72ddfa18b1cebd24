# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# What is installed: mono3d::mono3d and, as component `evaluation` of the package, mono3d::evaluation,
# each with its headers; the package config for CMake and pkg-config; the tools. In three components,
# which mono3d_packages.cmake makes packages of: `library` (what programs load), `development` (what
# compiling them takes), `tools` (programs with their manual and completion). A static library is
# of `development`.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/mono3d)

# mono3d_install_library(<target> <export>)
function(mono3d_install_library target export)
  install(TARGETS ${target} EXPORT ${export}
    LIBRARY COMPONENT library NAMELINK_COMPONENT development
    ARCHIVE COMPONENT development
    FILE_SET HEADERS COMPONENT development)
  install(EXPORT ${export} NAMESPACE mono3d:: DESTINATION ${package_dir} COMPONENT development)
endfunction()

mono3d_install_library(mono3d mono3dTargets)
if(MONO3D_BUILD_EVALUATION)
  mono3d_install_library(mono3d_evaluation_library mono3dEvaluationTargets)
endif()

get_target_property(mono3d_type mono3d TYPE)
set(MONO3D_IS_SHARED FALSE)
if(mono3d_type STREQUAL "SHARED_LIBRARY")
  set(MONO3D_IS_SHARED TRUE)
endif()
configure_package_config_file(cmake/mono3dConfig.cmake.in
  ${PROJECT_BINARY_DIR}/package/mono3dConfig.cmake INSTALL_DESTINATION ${package_dir})
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/package/mono3dConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/package/mono3dConfig.cmake
  ${PROJECT_BINARY_DIR}/package/mono3dConfigVersion.cmake
  DESTINATION ${package_dir} COMPONENT development)
# For pkg-config; where the library is static, with `pkg-config --static`. The tree may be moved.
# Of OpenCV only the module that the headers use: opencv4.pc links all of them. FFmpeg is shared, and
# its .pc files would ask for all that a static one needs.
foreach(folder LIBDIR INCLUDEDIR)
  file(RELATIVE_PATH MONO3D_PC_${folder}
    ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_FULL_${folder}})
endforeach()
list(TRANSFORM OpenCV_INCLUDE_DIRS PREPEND -I OUTPUT_VARIABLE opencv_cflags)
list(JOIN opencv_cflags " " MONO3D_PC_OPENCV_CFLAGS)
set(MONO3D_PC_REQUIRES_PRIVATE)
set(MONO3D_PC_LIBS_PRIVATE)
if(NOT MONO3D_IS_SHARED)
  set(MONO3D_PC_REQUIRES_PRIVATE "spirv-cross-c-shared, OpenEXR, yaml-cpp, libexif, libheif, libjpeg, libpng, expat")
  set(MONO3D_PC_LIBS_PRIVATE
    "-lopencv_imgproc -lopencv_imgcodecs -lopencv_videoio -lopencv_features2d -lopencv_calib3d"
    "-lopencv_aruco -lceres -lglog -lavformat -lavcodec -lswscale -lavutil -lstdc++ -lm -lpthread -ldl")
  list(JOIN MONO3D_PC_LIBS_PRIVATE " " MONO3D_PC_LIBS_PRIVATE)
endif()
configure_file(cmake/mono3d.pc.in ${PROJECT_BINARY_DIR}/package/mono3d.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/package/mono3d.pc
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)

# The licences, once for each component, in the folders where Debian looks for them.
set(MONO3D_PACKAGE_OF_library libmono3d${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(MONO3D_PACKAGE_OF_development libmono3d-dev)
set(MONO3D_PACKAGE_OF_tools mono3d-tools)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT development)
set(components development)
if(MONO3D_IS_SHARED)
  list(APPEND components library)
endif()
if(MONO3D_BUILD_TOOLS)
  list(APPEND components tools)
endif()
foreach(component IN LISTS components)
  install(FILES packaging/copyright COMPONENT ${component}
    DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${MONO3D_PACKAGE_OF_${component}})
endforeach()

# Of an installed program or library, where mono3d's libraries lie. A program of the build tree has
# this from the start: CMake would pad a shorter path with empty entries, each of which means the
# current folder, from which the program would then load libraries. Of a shared library it needs the
# path in the build tree, which is longer.
file(RELATIVE_PATH bin_to_lib ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
if(MONO3D_BUILD_EVALUATION)
  set_target_properties(mono3d_evaluation_library PROPERTIES INSTALL_RPATH "$ORIGIN")
endif()
if(MONO3D_BUILD_TOOLS)
  get_property(targets DIRECTORY tools PROPERTY BUILDSYSTEM_TARGETS)
  set(manuals)
  foreach(target IN LISTS targets)
    get_target_property(type ${target} TYPE)
    if(type STREQUAL "EXECUTABLE")
      set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN/${bin_to_lib}")
      if(MONO3D_IS_SHARED)
        set_target_properties(${target} PROPERTIES BUILD_RPATH ${PROJECT_BINARY_DIR}/libmono3d)
      else()
        set_target_properties(${target} PROPERTIES BUILD_WITH_INSTALL_RPATH ON)
      endif()
      install(TARGETS ${target} COMPONENT tools)
      # Each tool writes its page of the manual and its completion from its own table of options.
      if(NOT CMAKE_CROSSCOMPILING)
        set(page ${PROJECT_BINARY_DIR}/manual/${target}.1)
        set(completion ${PROJECT_BINARY_DIR}/completions/${target})
        file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/manual ${PROJECT_BINARY_DIR}/completions)
        # No test for leaks here: a sanitised tool would end with a status of its own.
        set(tool ${CMAKE_COMMAND} -E env ASAN_OPTIONS=detect_leaks=0 $<TARGET_FILE:${target}>)
        add_custom_command(OUTPUT ${page} ${completion}
          COMMAND ${tool} --man-page > ${page}
          COMMAND ${tool} --bash-completion > ${completion}
          DEPENDS ${target} VERBATIM)
        list(APPEND manuals ${page} ${completion})
        # Optional: they are not there where only some targets were built.
        install(FILES ${page} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 OPTIONAL COMPONENT tools)
        install(FILES ${completion} COMPONENT tools
          DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions OPTIONAL)
      endif()
    endif()
  endforeach()
  add_custom_target(manuals ALL DEPENDS ${manuals})
endif()
