#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Opens each product of a run by programs that are not ours, and says what they found there.
#   tests/products/check_products.sh out/products
# Takes what Debian has of them (gdal-bin, assimp-utils, cloudcompare, colmap) and npm (three,
# laz-perf); what is not installed is skipped and said. Ends with 0 where all that was opened could
# be, 1 where not.
set -u

folder=${1:?expected a folder of products}
here=$(dirname "$0")
export QT_QPA_PLATFORM=offscreen
failed=0
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# check NAME PROGRAM PATTERN COMMAND...: the output of the command must have the pattern.
check() {
  name=$1 program=$2 pattern=$3
  shift 3
  if ! command -v "$program" >/dev/null; then
    echo "$name: skipped: $program is not installed"
    return
  fi
  "$@" >"$work/log" 2>&1
  found=$(grep -E -m 3 "$pattern" "$work/log" | sed 's/^ *//' | tr '\n' ';')
  if [ -n "$found" ]; then
    echo "$name: $program: $found"
  else
    echo "$name: $program: FAILED: $(tail -n 1 "$work/log")"
    failed=1
  fi
}

for raster in dsm orthophoto; do
  [ -f "$folder/$raster.tif" ] || continue
  check "$raster.tif" gdalinfo 'Size is|LAYOUT=COG|Checksum=[1-9]' \
    gdalinfo -checksum "$folder/$raster.tif"
done
first_depth=$(find "$folder/depth" -name '*.tif' 2>/dev/null | sort | head -n 1)
[ -z "$first_depth" ] || check "depth" gdalinfo 'Size is|Type=Float32' gdalinfo "$first_depth"
if [ -f "$folder/model.las" ]; then
  "$here/check_las.sh" "$folder/model.las" || [ $? -eq 77 ] || failed=1
fi
for mesh in mesh.glb mesh.obj; do
  [ -f "$folder/$mesh" ] || continue
  check "$mesh" assimp '^(Vertices|Faces|Textures)' assimp info "$folder/$mesh"
done
[ ! -f "$folder/mesh.obj" ] || check mesh.obj CloudCompare 'faces' \
  CloudCompare -SILENT -O "$folder/mesh.obj"
[ ! -f "$folder/model_local.ply" ] || check model_local.ply CloudCompare 'Found one cloud' \
  CloudCompare -SILENT -O "$folder/model_local.ply"
[ ! -f "$folder/splats.ply" ] || check splats.ply CloudCompare 'Found one cloud' \
  CloudCompare -SILENT -O "$folder/splats.ply"
if [ -d "$folder/dense" ]; then
  check dense/sparse colmap 'Registered images|Points:|reprojection' \
    colmap model_analyzer --path "$folder/dense/sparse"
  check dense colmap 'Number of fused points: [1-9]' \
    colmap stereo_fusion --workspace_path "$folder/dense" --input_type geometric \
    --output_path "$work/fused.ply"
fi
if [ -f "$folder/mesh.glb" ] && command -v node >/dev/null && command -v npm >/dev/null &&
  npm install --silent --prefix "$work" three >/dev/null 2>&1; then
  cat >"$work/glb.mjs" <<'SCRIPT'
import {readFileSync} from 'fs';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
globalThis.self = globalThis;
console.error = () => {};  // Node cannot decode the texture
const bytes = readFileSync(process.argv[2]);
const data = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
const {scene} = await new Promise((take, fail) => new GLTFLoader().parse(data, '', take, fail));
let triangles = 0, textured = true;
scene.traverse((part) => {
  if (!part.isMesh) return;
  triangles += part.geometry.index.count / 3;
  textured &&= part.geometry.attributes.uv !== undefined;
});
console.log(`${triangles} triangles, texture coordinates: ${textured}`);
SCRIPT
  check mesh.glb node '^[1-9][0-9]* triangles, texture coordinates: true' \
    node "$work/glb.mjs" "$folder/mesh.glb"
else
  echo "mesh.glb: three.js: skipped: there is no node, npm or mesh"
fi
exit $failed
