# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Builds the shared library and a program that uses every stage through it, runs it, and reads which
# symbols of mono3d the library exports.

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE err)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    string(FIND "${out}" "FAILED:" failure)
    if(failure GREATER 0)
      string(SUBSTRING "${out}" ${failure} -1 out)
    endif()
    message(FATAL_ERROR "${command}\nended with ${result}:\n${out}${err}")
  endif()
  set(output "${out}" PARENT_SCOPE)
endfunction()

run(${CMAKE_COMMAND} --build ${BUILD_DIR} --target mono3d_shared_consumer)
run(${CONSUMER})

run(${NM} --dynamic --defined-only --demangle ${LIBRARY})
string(REGEX MATCHALL "mono3d::CreateTracker[^\n]*" interface "${output}")
if(NOT interface)
  message(FATAL_ERROR "mono3d::CreateTracker is not exported")
endif()
# Classes behind the interfaces.
string(REGEX MATCHALL "[^\n]* mono3d::(AnchorMap|Atlas|DepthMapFuser|ModelBuilder|MonocularTracker|Recorder|Submap)[^\n]*" internals
  "${output}")
if(internals)
  list(JOIN internals "\n" internals)
  message(FATAL_ERROR "internals are exported:\n${internals}")
endif()
