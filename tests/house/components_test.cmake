# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Installs each component of BUILD_DIR into a folder of its own below STAGE_DIR and looks at what is in it: every
# installed file is in one component, and each component has what its package promises. TOOLS: the
# programs; IS_SHARED: whether the libraries are.

cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE ${STAGE_DIR})
set(faults)

# install(<folder> <arguments of cmake --install>): sets <folder>_files, below STAGE_DIR/<folder>.
function(install_to folder)
  # Without debugging symbols: the programs are installed twice, 600 MB each time with them.
  execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${STAGE_DIR}/${folder} --strip ${ARGN}
    RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "cannot install ${folder}:\n${out}")
  endif()
  file(GLOB_RECURSE files RELATIVE ${STAGE_DIR}/${folder} ${STAGE_DIR}/${folder}/*)
  list(SORT files)
  set(${folder}_files "${files}" PARENT_SCOPE)
endfunction()

# expect(<component> <regex>): a file of the component matches.
function(expect component regex)
  set(found ${${component}_files})
  list(FILTER found INCLUDE REGEX "${regex}")
  if(NOT found)
    set(faults ${faults} "${component} has no file ${regex}" PARENT_SCOPE)
  endif()
endfunction()

# expect_only(<component> <regex>): all files of the component match.
function(expect_only component regex)
  set(others ${${component}_files})
  list(FILTER others EXCLUDE REGEX "${regex}")
  if(others)
    set(faults ${faults} "${component} has what is not its own: ${others}" PARENT_SCOPE)
  endif()
endfunction()

install_to(all)
foreach(component IN ITEMS library development tools)
  install_to(${component} --component ${component})
endforeach()

foreach(file IN LISTS all_files)
  set(components)
  foreach(component IN ITEMS library development tools)
    if(file IN_LIST ${component}_files)
      list(APPEND components ${component})
    endif()
  endforeach()
  list(LENGTH components num_components)
  if(NOT num_components EQUAL 1)
    list(APPEND faults "${file} is in ${num_components} components: ${components}")
  endif()
endforeach()

set(lib "^lib/([^/]+/)?")
expect_only(development
  "^include/mono3d/|${lib}cmake/mono3d/|${lib}pkgconfig/mono3d.pc$|${lib}lib[^/]*\\.(a|so)$|^share/doc/")
expect(development "^include/mono3d/mono3d.h$")
expect(development "^include/mono3d/pipeline/pipeline.h$")
expect(development "${lib}cmake/mono3d/mono3dConfig.cmake$")
expect(development "${lib}pkgconfig/mono3d.pc$")
if(IS_SHARED)
  expect(development "${lib}libmono3d.so$")
  expect(library "${lib}libmono3d.so.[0-9.]+$")
  expect(library "^share/doc/libmono3d[0-9.]+/copyright$")
  expect_only(library "${lib}lib[^/]*\\.so\\.|^share/doc/")
else()
  expect(development "${lib}libmono3d.a$")
  expect_only(library "^$")
endif()

expect_only(tools "^bin/mono3d-|^share/man/man1/mono3d-|^share/bash-completion/completions/mono3d-|^share/doc/")
foreach(tool IN LISTS TOOLS)
  expect(tools "^bin/${tool}$")
  expect(tools "^share/man/man1/${tool}.1$")
  expect(tools "^share/bash-completion/completions/${tool}$")
endforeach()
file(GLOB copyright ${STAGE_DIR}/tools/share/doc/*/copyright)
file(READ "${copyright}" text)
if(NOT text MATCHES "three.js authors")
  list(APPEND faults "${copyright} does not name three.js, which is part of the tools")
endif()

file(REMOVE_RECURSE ${STAGE_DIR})
if(faults)
  list(JOIN faults "\n" faults)
  message(FATAL_ERROR "${faults}")
endif()
list(LENGTH all_files num_files)
message("${num_files} files in three components")
