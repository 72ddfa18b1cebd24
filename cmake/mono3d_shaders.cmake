# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# mono3d_embed_shader(<source> <header> <array>)
# Compiles a shader to SPIR-V and embeds it as an array in a header. It may include what lies under
# shaders/ and tests/.
function(mono3d_embed_shader source header array)
  cmake_path(GET header PARENT_PATH folder)
  cmake_path(RELATIVE_PATH source BASE_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE shown)
  add_custom_command(
    OUTPUT ${header}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${folder}
    COMMAND Vulkan::glslangValidator -V --quiet --target-env vulkan1.2
            -I${PROJECT_SOURCE_DIR}/shaders -I${PROJECT_SOURCE_DIR}/tests
            --depfile ${header}.d --vn ${array} -o ${header} ${source}
    DEPENDS ${source}
    DEPFILE ${header}.d
    COMMENT "Compiling shader ${shown}"
    VERBATIM)
endfunction()

# mono3d_shaders(<target> <module> <stage>...)
# Embeds shaders/<module>/<stage>.comp as the array <module>_<stage>_spirv in the header
# "<module>/<stage>.spirv.h" of the build folder.
function(mono3d_shaders target module)
  set(headers)
  foreach(stage IN LISTS ARGN)
    set(header ${PROJECT_BINARY_DIR}/generated/${module}/${stage}.spirv.h)
    mono3d_embed_shader(${PROJECT_SOURCE_DIR}/shaders/${module}/${stage}.comp ${header}
                        ${module}_${stage}_spirv)
    list(APPEND headers ${header})
  endforeach()
  # A target of its own: the module is declared in another folder, where these outputs are not known.
  add_custom_target(${target}_shaders DEPENDS ${headers})
  add_dependencies(${target} ${target}_shaders)
endfunction()

# mono3d_test_shaders(<module> <name>...)
# For the test program of a module: embeds tests/<module>/shaders/<name>.comp as the array
# test_<name>_spirv in the header "<module>/shaders/<name>.spirv.h".
function(mono3d_test_shaders module)
  foreach(name IN LISTS ARGN)
    set(header ${PROJECT_BINARY_DIR}/generated/${module}/shaders/${name}.spirv.h)
    mono3d_embed_shader(${PROJECT_SOURCE_DIR}/tests/${module}/shaders/${name}.comp ${header}
                        test_${name}_spirv)
    target_sources(mono3d_${module}_test PRIVATE ${header})
  endforeach()
endfunction()
