// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Neighbours in a row of a map of floats, rows of `width` without padding: for four pixels at once,
// by whole texels, which cost little more than single floats. The including shader declares the
// specialisation constant kWholeTexels: rows are whole texels, so that none begins within one.

// Twelve floats from number `shift`, 0 to 3, of four texels.
void CutTexels(vec4 texels[4], int shift, out float v[12]) {
  float t[16];
  [[unroll]] for (int i = 0; i < 4; ++i) {
    t[4 * i] = texels[i].x;
    t[4 * i + 1] = texels[i].y;
    t[4 * i + 2] = texels[i].z;
    t[4 * i + 3] = texels[i].w;
  }
  const bool by2 = !kWholeTexels && (shift & 2) != 0;
  const bool by1 = !kWholeTexels && (shift & 1) != 0;
  float u[14];
  [[unroll]] for (int i = 0; i < 14; ++i) u[i] = by2 ? t[min(i + 2, 15)] : t[i];
  [[unroll]] for (int i = 0; i < 12; ++i) v[i] = by1 ? u[i + 1] : u[i];
}

// Columns 4 * group - 4 .. 4 * group + 7 of a row within the map, an rgba32f binding, to float
// v[12]. Those outside the map hold anything.
#define LOAD_MAP_ROW(map, width, height, group, row, v)                            \
  {                                                                                \
    const int first = (row) * (width) + 4 * (group) - 4;                           \
    const int last_texel = ((width) * (height) - 1) >> 2;                          \
    vec4 texels[4];                                                                \
    texels[3] = vec4(0);                                                           \
    [[unroll]] for (int texel = 0; texel < (kWholeTexels ? 3 : 4); ++texel)        \
        texels[texel] = imageLoad(map, clamp((first >> 2) + texel, 0, last_texel)); \
    CutTexels(texels, first & 3, v);                                               \
  }

// The four pixels from `x` on of a row, as far as the map has them, to a map that is declared as
// texels.
#define STORE_FOUR(map, width, x, y, values)                                \
  {                                                                         \
    const int pixel = (y) * (width) + (x);                                  \
    if (kWholeTexels) {                                                     \
      map[pixel >> 2] = values;                                             \
    } else {                                                                \
      [[unroll]] for (int i = 0; i < 4; ++i) {                              \
        if ((x) + i < (width)) map[(pixel + i) >> 2][(pixel + i) & 3] = values[i]; \
      }                                                                     \
    }                                                                       \
  }
