# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Target `docs`: the API documentation, from the public headers, into <build>/docs/html.
find_program(MONO3D_DOXYGEN doxygen)
if(MONO3D_DOXYGEN)
  file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/docs)
  add_custom_target(docs
    COMMAND ${CMAKE_COMMAND} -E env
            MONO3D_VERSION=${PROJECT_VERSION} MONO3D_DOCS_DIR=${PROJECT_BINARY_DIR}/docs
            ${MONO3D_DOXYGEN} docs/Doxyfile
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
    COMMENT "Writing the API documentation to ${PROJECT_BINARY_DIR}/docs/html"
    VERBATIM)
endif()
