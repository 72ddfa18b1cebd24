#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Reads a LAS file by a program that is not ours: every point by laz-perf (Hobu), under Node.
#   tests/products/check_las.sh out/products/model.las
# Ends with 0 where all points lie within the bounds that the header tells, 1 where not, 77 where
# the check cannot be made here, and says why.
set -eu

file=${1:?expected a LAS file}
for program in node npm; do
  if ! command -v "$program" >/dev/null; then
    echo "check_las.sh: skipped: $program is not installed"
    exit 77
  fi
done
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
if ! npm install --silent --prefix "$folder" laz-perf >/dev/null 2>&1; then
  echo "check_las.sh: skipped: npm cannot fetch laz-perf"
  exit 77
fi
cat >"$folder/check.mjs" <<'SCRIPT'
import {readFileSync} from 'fs';
import {createLazPerf} from 'laz-perf';
const perf = await createLazPerf();
const bytes = readFileSync(process.argv[2]);
const header = new DataView(bytes.buffer, bytes.byteOffset);
const number = (at) => header.getFloat64(at, true);
const scale = [131, 139, 147].map(number), offset = [155, 163, 171].map(number);
const most = [179, 195, 211].map(number), least = [187, 203, 219].map(number);
const data = perf._malloc(bytes.length);
perf.HEAPU8.set(bytes, data);
const file = new perf.LASZip();
file.open(data, bytes.length);
const count = Number(header.getBigUint64(247, true));
const point = perf._malloc(file.getPointLength());
let outside = 0, first;
for (let i = 0; i < count; ++i) {
  file.getPoint(point);
  const fields = new DataView(perf.HEAPU8.buffer, point, file.getPointLength());
  const place = [0, 1, 2].map((k) => fields.getInt32(4 * k, true) * scale[k] + offset[k]);
  first ??= place;
  if (place.some((x, k) => x < least[k] - scale[k] || x > most[k] + scale[k])) ++outside;
}
console.log(`${file.getCount()} of ${count} points of format ${file.getPointFormat()}, ` +
    `${file.getPointLength()} bytes each; the first at ${first.map((x) => x.toFixed(3))}; ` +
    `${outside} outside the bounds`);
process.exit(outside === 0 && file.getCount() === count && count > 0 ? 0 : 1);
SCRIPT
node "$folder/check.mjs" "$file"
