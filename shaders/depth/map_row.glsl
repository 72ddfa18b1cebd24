// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Neighbours in a row of a map of floats, rows of `width` without padding: for four pixels at once, by
// whole texels, which cost little more than single floats. The including shader defines MAP as the
// name of the rgba32f binding.

// Columns 4 * group - 4 .. 4 * group + 7 of a row within the map. Those outside the map hold anything.
void LoadMapRow(int width, int height, int group, int row, out float v[12]) {
  const int first = row * width + 4 * group - 4;
  const int last_texel = (width * height - 1) >> 2;
  float t[16];
  [[unroll]] for (int i = 0; i < 4; ++i) {
    const vec4 texel = imageLoad(MAP, clamp((first >> 2) + i, 0, last_texel));
    t[4 * i] = texel.x;
    t[4 * i + 1] = texel.y;
    t[4 * i + 2] = texel.z;
    t[4 * i + 3] = texel.w;
  }
  const bool by2 = (first & 2) != 0;
  const bool by1 = (first & 1) != 0;
  float u[14];
  [[unroll]] for (int i = 0; i < 14; ++i) u[i] = by2 ? t[min(i + 2, 15)] : t[i];
  [[unroll]] for (int i = 0; i < 12; ++i) v[i] = by1 ? u[i + 1] : u[i];
}
