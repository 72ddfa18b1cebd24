# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# mono3d_shaders(<target> <room> <stage>...)
# Compiles shaders/<room>/<stage>.comp to SPIR-V and embeds it as the array <room>_<stage>_spirv in
# the header "<room>/<stage>.spirv.h" of the build folder.
function(mono3d_shaders target room)
  set(headers)
  foreach(stage IN LISTS ARGN)
    set(source ${PROJECT_SOURCE_DIR}/shaders/${room}/${stage}.comp)
    set(header ${PROJECT_BINARY_DIR}/generated/${room}/${stage}.spirv.h)
    add_custom_command(
      OUTPUT ${header}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${PROJECT_BINARY_DIR}/generated/${room}
      COMMAND Vulkan::glslangValidator -V --quiet --target-env vulkan1.2
              -I${PROJECT_SOURCE_DIR}/shaders --depfile ${header}.d
              --vn ${room}_${stage}_spirv -o ${header} ${source}
      DEPENDS ${source}
      DEPFILE ${header}.d
      COMMENT "Compiling shader ${room}/${stage}"
      VERBATIM)
    list(APPEND headers ${header})
  endforeach()
  # A target of its own: the room is declared in another folder, where these outputs are not known.
  add_custom_target(${target}_shaders DEPENDS ${headers})
  add_dependencies(${target} ${target}_shaders)
endfunction()
