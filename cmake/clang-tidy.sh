#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Runs clang-tidy, every finding an error, on what the preset dev compiles, or on some sources:
#   cmake/clang-tidy.sh [SOURCE ...]
set -eu
cd "$(dirname "$0")/.."

# A folder of its own: clang does not read all of GCC's options, and reads source by source.
build=build/clang-tidy
log=$(cmake --preset dev -B "$build" -DMONO3D_UNITY_BUILD=OFF \
  -DMONO3D_WARNINGS_AS_ERRORS=OFF 2>&1) || { echo "$log" >&2; exit 1; }
shaders=$(ninja -C "$build" -t targets all | sed -n 's/^\(generated.*\.spirv\.h\):.*/\1/p')
# shellcheck disable=SC2086  # the list is meant to be split
ninja -C "$build" --quiet $shaders

# The consumer and the examples are projects of their own.
if [ $# -eq 0 ]; then
  set -- $(find libmono3d tools tests -name '*.cpp' -not -path 'tests/consumer/*' | sort)
fi
printf '%s\n' "$@" | xargs -P "$(nproc)" -n 1 clang-tidy -p "$build" --quiet
