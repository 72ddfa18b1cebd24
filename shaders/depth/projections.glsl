// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Where the sources see a pixel of the reference. The including shader declares the r32f binding
// `projections`: per source 12 numbers, a row-major 3x3 matrix A and a vector b; the pixel
// p = (x, y, 1) on the plane of inverse depth w is seen at A p + w b (homogeneous).

vec3 LoadVector(int first, int step) {
  return vec3(imageLoad(projections, first).x, imageLoad(projections, first + step).x,
              imageLoad(projections, first + 2 * step).x);
}

vec3 LoadAp(int source, vec3 p) {
  const int first = 12 * source;
  return mat3(LoadVector(first, 3), LoadVector(first + 1, 3), LoadVector(first + 2, 3)) * p;
}

vec3 LoadB(int source) { return LoadVector(12 * source + 9, 1); }
