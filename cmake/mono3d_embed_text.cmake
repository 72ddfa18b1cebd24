# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# mono3d_embed_text(<target> <function> <file>)
# Adds to the target a source that defines std::string_view mono3d::tools::<function>(): the text of
# the file.
function(mono3d_embed_text target function file)
  cmake_path(ABSOLUTE_PATH file)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${target}_text/${function}.cpp)
  set(script ${PROJECT_SOURCE_DIR}/cmake/mono3d_write_text_source.cmake)
  cmake_path(RELATIVE_PATH file BASE_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE shown)
  add_custom_command(
    OUTPUT ${source}
    COMMAND ${CMAKE_COMMAND} -DTEXT=${file} -DSOURCE=${source} -DFUNCTION=${function} -P ${script}
    DEPENDS ${file} ${script}
    COMMENT "Embedding ${shown}"
    VERBATIM)
  target_sources(${target} PRIVATE ${source})
endfunction()
