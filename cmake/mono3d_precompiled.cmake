# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Headers that most sources include, compiled once: halves the time of a build from nothing. Off by
# default: compiler caches do not see through them, and a source must compile without them.
#   mono3d_precompiled       for modules and tools
#   mono3d_precompiled_test  for tests, which are not position-independent and use GoogleTest
set(standard_headers <algorithm> <array> <cmath> <filesystem> <functional> <memory> <optional>
  <span> <string> <vector>)
set(outside_headers <Eigen/Core> <Eigen/Geometry> <opencv2/core.hpp> <opencv2/imgproc.hpp>)

function(mono3d_add_precompiled target)
  add_library(${target} OBJECT ${PROJECT_SOURCE_DIR}/cmake/precompiled.cpp)
  target_compile_features(${target} PRIVATE cxx_std_20)
  target_link_libraries(${target} PRIVATE mono3d_warnings Eigen3::Eigen opencv_core opencv_imgproc)
  target_precompile_headers(${target} PRIVATE ${standard_headers} ${outside_headers} ${ARGN})
endfunction()

if(MONO3D_PRECOMPILED_HEADERS)
  mono3d_add_precompiled(mono3d_precompiled)
  set_target_properties(mono3d_precompiled PROPERTIES POSITION_INDEPENDENT_CODE ON)
  if(MONO3D_BUILD_TESTS)
    mono3d_add_precompiled(mono3d_precompiled_test <gmock/gmock.h> <gtest/gtest.h>)
    target_link_libraries(mono3d_precompiled_test PRIVATE GTest::gmock)
  endif()
endif()

# mono3d_precompile(<target> <precompiled>): uses one of the two, when they are on.
function(mono3d_precompile target precompiled)
  if(MONO3D_PRECOMPILED_HEADERS)
    target_precompile_headers(${target} REUSE_FROM ${precompiled})
  endif()
endfunction()
