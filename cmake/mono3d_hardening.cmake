# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# What keeps a mistake of ours from being more than a crash. ThreadSanitizer has none of it: it is
# incompatible with some and its programs are never installed.

option(MONO3D_HARDENING "Harden what is built; off only to measure what that costs" ON)
mark_as_advanced(MONO3D_HARDENING)

set(MONO3D_IS_HARDENED ${MONO3D_HARDENING})
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=thread")
  set(MONO3D_IS_HARDENED FALSE)
endif()

if(MONO3D_IS_HARDENED)
  # Of every program and shared library: addresses of its own at each start, and tables of functions
  # that are bound at the start and cannot be written afterwards.
  include(CheckPIESupported)
  check_pie_supported()
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
  add_link_options(-Wl,-z,relro,-z,now)
endif()

# mono3d_harden(<target>): of what handles files of unknown origin. Not of the modules that compute:
# the checks of the standard library's containers cost time in their loops.
function(mono3d_harden target)
  if(NOT MONO3D_IS_HARDENED)
    return()
  endif()
  target_compile_definitions(${target} PRIVATE _GLIBCXX_ASSERTIONS)
  target_compile_options(${target} PRIVATE -fstack-protector-strong)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    target_compile_options(${target} PRIVATE -fcf-protection)
  endif()
  # AddressSanitizer has checks of its own in the place of these, which need an optimising compiler.
  if(NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
    target_compile_options(${target} PRIVATE
      $<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE> $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=2>)
  endif()
endfunction()
