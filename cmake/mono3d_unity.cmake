# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Unity build: many sources of a target compiled as one file, which parses their headers and
# instantiates their templates once. Halves the processor time of a build from nothing; a change
# compiles a whole file of them again, so it is off by default.
# Names in unnamed namespaces, macros and using-declarations of a target must therefore differ.
option(MONO3D_UNITY_BUILD "Build faster from nothing: many sources as one" OFF)
set(MONO3D_UNITY_SOURCES 16 CACHE STRING "Sources that a unity build compiles as one, at most")
mark_as_advanced(MONO3D_UNITY_SOURCES)

# A compiler takes up to 1.6 GB for so many sources: no more at a time than the memory holds (Ninja).
if(MONO3D_UNITY_BUILD)
  cmake_host_system_information(RESULT memory_mib QUERY TOTAL_PHYSICAL_MEMORY)
  math(EXPR num_compilers "${memory_mib} / 1700 + 1")
  set_property(GLOBAL APPEND PROPERTY JOB_POOLS mono3d_compile=${num_compilers})
  set(CMAKE_JOB_POOL_COMPILE mono3d_compile)
endif()

# mono3d_unity(<target>): once all sources of the target are named.
function(mono3d_unity target)
  if(NOT MONO3D_UNITY_BUILD)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.cpp$")
  list(LENGTH sources num_sources)
  # Files of about the same size, so that two processors end at about the same time.
  math(EXPR num_files "(${num_sources} + ${MONO3D_UNITY_SOURCES} - 1) / ${MONO3D_UNITY_SOURCES}")
  math(EXPR batch_size "(${num_sources} + ${num_files} - 1) / ${num_files}")
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${batch_size})
  # GCC takes the unnamed namespaces of the sources for those of a header.
  target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
endfunction()
