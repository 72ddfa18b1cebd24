# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# A module is one folder with one job: public headers in include/mono3d/<module>, the rest in src/<module>.
# Each is compiled once, as an object library; a library is the objects of its modules, and a test
# links the objects of its own module and of the modules that it uses.

# GCC 12 sees ghosts in what it inlines from system headers: maybe-uninitialized in Eigen's
# decompositions stays a warning, and restrict in strings is left out. The sanitizers find the real
# ones.
add_library(mono3d_warnings INTERFACE)
target_compile_options(mono3d_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow
  $<$<CONFIG:Release>:-Wno-restrict>
  $<$<BOOL:${MONO3D_WARNINGS_AS_ERRORS}>:-Werror;-Wno-error=maybe-uninitialized>)

# mono3d_library(<name> [STATIC])
# Declares the library mono3d::<name>. All others use mono3d::mono3d. Of the type that
# BUILD_SHARED_LIBS says, or static and then not installed. Its target is mono3d or
# mono3d_<name>_library, in MONO3D_LIBRARY_OF_<name>: mono3d_<name> is the module of that name.
function(mono3d_library name)
  cmake_parse_arguments(ARG "STATIC" "" "" ${ARGN})
  set(target mono3d)
  if(NOT name STREQUAL "mono3d")
    set(target mono3d_${name}_library)
  endif()
  if(ARG_STATIC)
    add_library(${target} STATIC)
  else()
    add_library(${target})
  endif()
  add_library(mono3d::${name} ALIAS ${target})
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES
    EXPORT_NAME ${name}
    VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
    POSITION_INDEPENDENT_CODE ON LINKER_LANGUAGE CXX
    VERIFY_INTERFACE_HEADER_SETS ON)
  if(NOT name STREQUAL "mono3d")
    set_target_properties(${target} PROPERTIES OUTPUT_NAME mono3d_${name})
    target_link_libraries(${target} PUBLIC mono3d)
  endif()
  set(MONO3D_LIBRARY_OF_${name} ${target} PARENT_SCOPE)
endfunction()

# mono3d_module(<name> USES <module>... [LIBRARY <library>])
# Declares a module and the modules that it may include, and reads its file list from src/<name>. It
# is a part of library mono3d unless LIBRARY names another one.
function(mono3d_module name)
  cmake_parse_arguments(ARG "" "LIBRARY" "USES" ${ARGN})
  set(closure ${name})
  foreach(used IN LISTS ARG_USES)
    get_target_property(used_closure mono3d_${used} MONO3D_MODULE_CLOSURE)
    list(APPEND closure ${used_closure})
  endforeach()
  list(REMOVE_DUPLICATES closure)

  set(target mono3d_${name})
  add_library(${target} OBJECT)
  set_target_properties(${target} PROPERTIES
    MONO3D_MODULE_CLOSURE "${closure}" POSITION_INDEPENDENT_CODE ON
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target} PUBLIC
    ${PROJECT_SOURCE_DIR}/libmono3d/include ${PROJECT_SOURCE_DIR}/libmono3d/src
    ${PROJECT_SOURCE_DIR}/shaders ${PROJECT_BINARY_DIR}/generated)
  target_link_libraries(${target} PRIVATE mono3d_warnings)
  foreach(used IN LISTS ARG_USES)
    target_link_libraries(${target} PUBLIC mono3d_${used})
  endforeach()
  string(JOIN " " uses ${ARG_USES})
  set_property(GLOBAL APPEND PROPERTY MONO3D_MODULE_TABLE "${name}: ${uses}")
  set(MONO3D_MODULE ${name})
  if(ARG_LIBRARY)
    set_property(GLOBAL APPEND PROPERTY MONO3D_MODULES_BESIDE ${name})
  else()
    set(ARG_LIBRARY mono3d)
  endif()
  set(MONO3D_MODULE_LIBRARY ${MONO3D_LIBRARY_OF_${ARG_LIBRARY}})
  target_sources(${MONO3D_MODULE_LIBRARY} PRIVATE $<TARGET_OBJECTS:${target}>)
  set_property(TARGET ${MONO3D_MODULE_LIBRARY} APPEND PROPERTY MONO3D_MODULES ${name})
  add_subdirectory(${PROJECT_SOURCE_DIR}/libmono3d/src/${name})
endfunction()

# mono3d_module_files([PUBLIC_HEADERS <file>...] SOURCES <file>... [SHADERS <stage>...]
#                     [PUBLIC_LIBRARIES <target>...] [LIBRARIES <target>...])
# Called from src/<module>/CMakeLists.txt. PUBLIC_LIBRARIES appear in public headers.
function(mono3d_module_files)
  cmake_parse_arguments(ARG "" ""
    "PUBLIC_HEADERS;SOURCES;SHADERS;PUBLIC_LIBRARIES;LIBRARIES" ${ARGN})
  set(target mono3d_${MONO3D_MODULE})
  set(library ${MONO3D_MODULE_LIBRARY})
  target_sources(${target} PRIVATE ${ARG_SOURCES})
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC_LIBRARIES} ${ARG_LIBRARIES})
  mono3d_unity(${target})
  if(ARG_SHADERS)
    mono3d_shaders(${target} ${MONO3D_MODULE} ${ARG_SHADERS})
  endif()
  target_link_libraries(${library} PUBLIC ${ARG_PUBLIC_LIBRARIES} PRIVATE ${ARG_LIBRARIES})
  if(ARG_PUBLIC_HEADERS)
    set(include_dir ${PROJECT_SOURCE_DIR}/libmono3d/include)
    list(TRANSFORM ARG_PUBLIC_HEADERS PREPEND ${include_dir}/mono3d/${MONO3D_MODULE}/)
    target_sources(${library} PUBLIC
      FILE_SET HEADERS BASE_DIRS ${include_dir} FILES ${ARG_PUBLIC_HEADERS})
  else()
    # Not installed: its headers are those in src/.
    target_include_directories(${library} PUBLIC ${PROJECT_SOURCE_DIR}/libmono3d/src)
  endif()
endfunction()

# mono3d_link_modules(<target> <module>...): objects and usage of the modules and of all that they use.
function(mono3d_link_modules target)
  set(closure)
  foreach(module IN LISTS ARGN)
    get_target_property(module_closure mono3d_${module} MONO3D_MODULE_CLOSURE)
    list(APPEND closure ${module_closure})
  endforeach()
  list(REMOVE_DUPLICATES closure)
  foreach(module IN LISTS closure)
    target_link_libraries(${target} PRIVATE mono3d_${module})
  endforeach()
endfunction()
