// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Projection of a pixel of the reference into the sources. The including shader declares the
// rgba32f binding `projections`: the bounds of the reference, then per source 16 numbers, a
// row-major 3x3 matrix A, a vector b and its bounds; the pixel p = (x, y, 1) on the plane of
// inverse depth w is seen at A p + w b (homogeneous). Bounds are the first and the last pixel that
// show something, xy and zw.

struct Projection {
  mat3 A;
  vec3 b;
  vec4 bounds;
};

Projection LoadProjection(int source) {
  const vec4 t0 = imageLoad(projections, 4 * source + 1);
  const vec4 t1 = imageLoad(projections, 4 * source + 2);
  const vec4 t2 = imageLoad(projections, 4 * source + 3);
  const vec4 bounds = imageLoad(projections, 4 * source + 4);
  return Projection(transpose(mat3(t0.xyz, vec3(t0.w, t1.xy), vec3(t1.zw, t2.x))), t2.yzw, bounds);
}

// Does the reference show something there?
bool ReferenceShows(vec2 pixel) {
  const vec4 bounds = imageLoad(projections, 0);
  return all(greaterThanEqual(pixel, bounds.xy)) && all(lessThanEqual(pixel, bounds.zw));
}
