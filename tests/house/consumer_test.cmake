# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Installs the tree in BUILD_DIR to STAGE_DIR, configures and builds CONSUMER_SOURCE_DIR against it
# and runs PROGRAMS, where given, which must print VERSION. CONFIGURE_OPTIONS and BUILD_OPTIONS are handed on.

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    # What failed comes behind pages of warnings about other people's headers.
    string(FIND "${out}" "FAILED:" failure)
    if(failure GREATER 0)
      string(SUBSTRING "${out}" ${failure} -1 out)
    endif()
    message(FATAL_ERROR "${command}\nended with ${result}:\n${out}")
  endif()
  set(output "${out}" PARENT_SCOPE)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${STAGE_DIR})

file(REMOVE_RECURSE ${CONSUMER_BUILD_DIR})
run(${CMAKE_COMMAND} -S ${CONSUMER_SOURCE_DIR} -B ${CONSUMER_BUILD_DIR} -G ${GENERATOR}
  -D CMAKE_PREFIX_PATH=${STAGE_DIR} -D CMAKE_FIND_USE_PACKAGE_REGISTRY=OFF
  -D CMAKE_BUILD_TYPE=${BUILD_TYPE} -D CMAKE_CXX_FLAGS=${CXX_FLAGS}
  -D CMAKE_CXX_COMPILER_LAUNCHER=${CXX_COMPILER_LAUNCHER} ${CONFIGURE_OPTIONS})

# The library that was found is the one that was just installed.
file(STRINGS ${CONSUMER_BUILD_DIR}/CMakeCache.txt found REGEX "^mono3d_DIR:")
if(NOT found MATCHES "=${STAGE_DIR}/")
  message(FATAL_ERROR "expected mono3d below ${STAGE_DIR}, found ${found}")
endif()

run(${CMAKE_COMMAND} --build ${CONSUMER_BUILD_DIR} ${BUILD_OPTIONS})

foreach(program IN LISTS PROGRAMS)
  run(${CONSUMER_BUILD_DIR}/${program})
  if(NOT output MATCHES "mono3d ${VERSION}")
    message(FATAL_ERROR "expected \"mono3d ${VERSION}\" in the output, found:\n${output}")
  endif()
endforeach()
