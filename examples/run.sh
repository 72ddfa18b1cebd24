#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Installs what is missing, builds the library and the tools that make and show models, and turns the
# images of examples/village_orbit into a coloured model:
#   examples/run.sh [OUTPUT_FOLDER]
# `cmake --install build/release-tools` installs what it built. MONO3D_BUILD=FOLDER takes the tools that
# were built there, and builds nothing.
set -eu
cd "$(dirname "$0")/.."

sequence=examples/village_orbit
output=${1:-out/village_orbit}
build=${MONO3D_BUILD:-build/release-tools}

if [ -z "${MONO3D_BUILD:-}" ]; then
  cmake/install-dependencies.sh product
  cmake --preset release -B "$build" -DMONO3D_UNITY_BUILD=ON -DMONO3D_BUILD_TESTS=OFF \
    -DMONO3D_BUILD_EVALUATION=OFF -DMONO3D_BUILD_SYNTHETIC=OFF
  cmake --build "$build"
fi

"$build/tools/mono3d-reconstruct" "$sequence" --camera "$sequence/camera.yaml" -o "$output"

model=$(cd "$output" && pwd)/model.ply
surfels=$(head -c 4096 "$model" | sed -n 's/^element vertex //p')
echo
echo "Model: $model ($surfels surfels)"
echo "Any viewer of PLY files shows it, for example MeshLab or CloudCompare."
