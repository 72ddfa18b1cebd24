# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# A compiler cache, where one is installed and the user names no other launcher.
option(MONO3D_COMPILER_CACHE "Compile through ccache when it is installed" ${PROJECT_IS_TOP_LEVEL})
if(MONO3D_COMPILER_CACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  find_program(MONO3D_CCACHE ccache)
  mark_as_advanced(MONO3D_CCACHE)
  if(MONO3D_CCACHE)
    set(CMAKE_CXX_COMPILER_LAUNCHER ${MONO3D_CCACHE})
  endif()
endif()
