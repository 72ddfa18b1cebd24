#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Installs what is missing, builds everything and runs all tests:
#   tests/run.sh [-DCMAKE_OPTION=VALUE ...]
set -eu
cd "$(dirname "$0")/.."

cmake/install-dependencies.sh
cmake --preset dev -DMONO3D_UNITY_BUILD=ON "$@"
cmake --build --preset dev
ctest --preset dev -j "$(nproc)"
