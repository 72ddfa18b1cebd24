// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Projection of a pixel of the reference into the sources. The including shader declares the
// rgba32f binding `projections`: per source 12 numbers, a row-major 3x3 matrix A and a vector b;
// the pixel p = (x, y, 1) on the plane of inverse depth w is seen at A p + w b (homogeneous).

struct Projection {
  mat3 A;
  vec3 b;
};

Projection LoadProjection(int source) {
  const vec4 t0 = imageLoad(projections, 3 * source);
  const vec4 t1 = imageLoad(projections, 3 * source + 1);
  const vec4 t2 = imageLoad(projections, 3 * source + 2);
  return Projection(transpose(mat3(t0.xyz, vec3(t0.w, t1.xy), vec3(t1.zw, t2.x))), t2.yzw);
}
