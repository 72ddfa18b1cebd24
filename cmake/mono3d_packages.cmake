# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Debian packages of the installed components, by `cmake --workflow --preset package` or `cpack`. They need the
# shared library: what a tool loads is then of the version that its package says.
if(NOT MONO3D_IS_SHARED)
  return()
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME mono3d)
set(CPACK_PACKAGE_VENDOR "the mono3d authors")
set(CPACK_PACKAGE_CONTACT "the mono3d authors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)

set(CPACK_COMPONENTS_ALL library development)
if(MONO3D_BUILD_TOOLS)
  list(APPEND CPACK_COMPONENTS_ALL tools)
endif()
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENT_DEVELOPMENT_DEPENDS library)
set(CPACK_COMPONENT_TOOLS_DEPENDS library)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)  # of the very same version
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/libmono3d)
foreach(component IN ITEMS library development tools)
  string(TOUPPER ${component} name)
  set(CPACK_DEBIAN_${name}_PACKAGE_NAME ${MONO3D_PACKAGE_OF_${component}})
endforeach()

set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SHLIBDEPS ON)
# The Vulkan loader is loaded while the program runs, so dpkg-shlibdeps does not see it.
set(CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS libvulkan1)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_RECOMMENDS "mesa-vulkan-drivers | vulkan-icd")
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "The shared libraries: track one moving camera, estimate depth maps on the GPU
(Vulkan) and fuse them into a coloured model.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev, libopencv-core-dev")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Headers and the files for CMake's find_package and pkg-config.")

set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS "mesa-vulkan-drivers | vulkan-icd")
set(CPACK_COMPONENT_TOOLS_DESCRIPTION "The programs: mono3d-reconstruct turns the video of one moving camera, or
photographs, into a coloured 3D model; others show, measure, calibrate and
simulate.")

include(CPack)
