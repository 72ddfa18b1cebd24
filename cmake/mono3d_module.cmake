# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# A module is one folder with one job: public headers in include/mono3d/<module>, the rest in src/<module>.
# Each is compiled once, as an object library; the modules of the product together are the one
# installed library, and a test links the objects of its own module and of the modules that it uses.

# GCC 12 sees ghosts in what it inlines from system headers: maybe-uninitialized in Eigen's
# decompositions stays a warning, and the ghosts in strings, which it keeps to itself unless the
# headers are precompiled or much is inlined, are left out then. The sanitizers find the real ones.
add_library(mono3d_warnings INTERFACE)
target_compile_options(mono3d_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow
  $<$<BOOL:${MONO3D_PRECOMPILED_HEADERS}>:-Wno-array-bounds;-Wno-restrict;-Wno-stringop-overflow;-Wno-stringop-overread>
  $<$<CONFIG:Release>:-Wno-restrict>
  $<$<BOOL:${MONO3D_WARNINGS_AS_ERRORS}>:-Werror;-Wno-error=maybe-uninitialized>)

# mono3d_module(<name> USES <module>... [TARGET_OF_ITS_OWN])
# Declares a module and the modules that it may include, and reads its file list from src/<name>.
# TARGET_OF_ITS_OWN keeps it out of the installed library.
function(mono3d_module name)
  cmake_parse_arguments(ARG "TARGET_OF_ITS_OWN" "" "USES" ${ARGN})
  set(closure ${name})
  foreach(used IN LISTS ARG_USES)
    get_target_property(used_closure mono3d_${used} MONO3D_MODULE_CLOSURE)
    list(APPEND closure ${used_closure})
  endforeach()
  list(REMOVE_DUPLICATES closure)

  set(target mono3d_${name})
  add_library(${target} OBJECT)
  set_target_properties(${target} PROPERTIES
    MONO3D_MODULE_CLOSURE "${closure}" POSITION_INDEPENDENT_CODE ON)
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
  set(MONO3D_MODULE_INSTALLED TRUE)
  if(ARG_TARGET_OF_ITS_OWN)
    set(MONO3D_MODULE_INSTALLED FALSE)
  else()
    target_sources(mono3d PRIVATE $<TARGET_OBJECTS:${target}>)
  endif()
  add_subdirectory(${PROJECT_SOURCE_DIR}/libmono3d/src/${name})
endfunction()

# mono3d_module_files([PUBLIC_HEADERS <file>...] SOURCES <file>... [SHADERS <stage>...]
#                   [PUBLIC_LIBRARIES <target>...] [LIBRARIES <target>...]
#                   [PRECOMPILED_HEADER <file>])
# Called from src/<module>/CMakeLists.txt. PUBLIC_LIBRARIES appear in public headers.
# PRECOMPILED_HEADER is a private header to precompile in place of the common ones.
function(mono3d_module_files)
  cmake_parse_arguments(ARG "" "PRECOMPILED_HEADER"
    "PUBLIC_HEADERS;SOURCES;SHADERS;PUBLIC_LIBRARIES;LIBRARIES" ${ARGN})
  set(target mono3d_${MONO3D_MODULE})
  target_sources(${target} PRIVATE ${ARG_SOURCES})
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC_LIBRARIES} ${ARG_LIBRARIES})
  if(ARG_PRECOMPILED_HEADER AND MONO3D_PRECOMPILED_HEADERS)
    target_precompile_headers(${target} PRIVATE
      ${PROJECT_SOURCE_DIR}/libmono3d/src/${ARG_PRECOMPILED_HEADER})
  else()
    mono3d_precompile(${target} mono3d_precompiled)
  endif()
  if(ARG_SHADERS)
    mono3d_shaders(${target} ${MONO3D_MODULE} ${ARG_SHADERS})
  endif()
  if(MONO3D_MODULE_INSTALLED)
    set(include_dir ${PROJECT_SOURCE_DIR}/libmono3d/include)
    list(TRANSFORM ARG_PUBLIC_HEADERS PREPEND ${include_dir}/mono3d/${MONO3D_MODULE}/)
    target_sources(mono3d PUBLIC FILE_SET HEADERS BASE_DIRS ${include_dir} FILES ${ARG_PUBLIC_HEADERS})
    target_link_libraries(mono3d PUBLIC ${ARG_PUBLIC_LIBRARIES} PRIVATE ${ARG_LIBRARIES})
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
