#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Runs clang-tidy, every finding an error, on the sources as a configured and built tree compiles
# them:
#   cmake/clang-tidy.sh [BUILD_FOLDER [SOURCE ...]]
set -eu
cd "$(dirname "$0")/.."

build=${1:-build/dev}
[ $# -eq 0 ] || shift
if [ ! -f "$build/compile_commands.json" ]; then
  echo "clang-tidy.sh: $build is not configured; run cmake --preset dev first" >&2
  exit 2
fi

# Only what the build compiles: the consumer and the examples are projects of their own.
if [ $# -eq 0 ]; then
  set -- $(find libmono3d tools tests -name '*.cpp' | sort | while read -r source; do
    ! grep -q "$PWD/$source\"" "$build/compile_commands.json" || echo "$source"
  done)
fi
printf '%s\n' "$@" | xargs -P "$(nproc)" -n 1 clang-tidy -p "$build" --quiet
