// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Normals of four pixels of a row of a map of inverse depth. The including shader declares the
// bindings `inverse_depth` and `normals`, the parameters of normals.params.h and kWholeTexels.

#include "depth/map_row.glsl"

const int kRadius = 3;
const float kMinSupport = 4.0;  // pixels, which then do not lie on one line
const float kNone = -3e38;  // nowhere near any inverse depth

// Sums of the normal equations for w - middle = g0 + gx dx + gy dy.
struct Sums {
  float n, x, y, xx, xy, yy, w, xw, yw;
};

vec3 NormalOf(Sums s, float middle, float x, float y) {
  const float per_tolerance = 1.0 / params.tolerance;  // brings w near 1, whatever the scale
  const float sw = s.w * per_tolerance;
  // Gradient by Cramer's rule on the centred moments.
  const float cxx = s.n * s.xx - s.x * s.x;
  const float cxy = s.n * s.xy - s.x * s.y;
  const float cyy = s.n * s.yy - s.y * s.y;
  const float cxw = s.n * (s.xw * per_tolerance) - s.x * sw;
  const float cyw = s.n * (s.yw * per_tolerance) - s.y * sw;
  const float determinant = cxx * cyy - cxy * cxy;
  if (!(middle > 0.0 && s.n >= kMinSupport && determinant > 1e-3 * cxx * cyy && cxx > 0.0 && cyy > 0.0)) {
    return vec3(0);
  }
  const float gx = params.tolerance * (cxw * cyy - cyw * cxy) / determinant;
  const float gy = params.tolerance * (cyw * cxx - cxw * cxy) / determinant;
  const float g0 = middle + (params.tolerance * sw - gx * s.x - gy * s.y) / s.n;
  const float at_origin = g0 - gx * x - gy * y;
  const vec3 outwards =
      vec3(params.fx * gx, params.fy * gy, params.cx * gx + params.cy * gy + at_origin);
  // Surfaces seen more edge-on than the axis allows have no normal towards the camera plane.
  return outwards.z > 0.0 ? -normalize(outwards) : vec3(0);
}

// Pixels 4 * group to 4 * group + 3 of a row within the map.
void NormalsOfFour(int group, int y, out vec3 found[4]) {
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  float row[12];
  LOAD_MAP_ROW(inverse_depth, width, height, group, y, row)
  const vec4 middle = vec4(row[4], row[5], row[6], row[7]);

  Sums sums[4];
  [[unroll]] for (int p = 0; p < 4; ++p) sums[p] = Sums(0, 0, 0, 0, 0, 0, 0, 0, 0);
  [[unroll]] for (int dy = -kRadius; dy <= kRadius; dy += kRadius) {
    LOAD_MAP_ROW(inverse_depth, width, height, group, clamp(y + dy, 0, height - 1), row)
    const bool row_inside = y + dy >= 0 && y + dy < height;
    [[unroll]] for (int i = 1; i < 11; ++i) {
      const int column = 4 * group - 4 + i;
      const bool inside = row_inside && column >= 0 && column < width;
      row[i] = inside && row[i] > 0.0 ? row[i] : kNone;
    }
    const float fdy = float(dy);
    const float distance_y = max(abs(fdy), 1.0);
    [[unroll]] for (int p = 0; p < 4; ++p) {
      float n = 0.0, sx = 0.0, sxx = 0.0, sw = 0.0, sxw = 0.0;  // of this row
      [[unroll]] for (int dx = -kRadius; dx <= kRadius; dx += kRadius) {
        const float difference = row[p + 4 + dx] - middle[p];
        const bool near = abs(difference) <= params.tolerance * max(float(abs(dx)), distance_y);
        const float u = near ? 1.0 : 0.0;
        const float w = near ? difference : 0.0;
        n += u;
        sx += u * float(dx);
        sxx += u * float(dx * dx);
        sw += w;
        sxw += w * float(dx);
      }
      sums[p].n += n;
      sums[p].x += sx;
      sums[p].y += n * fdy;
      sums[p].xx += sxx;
      sums[p].xy += sx * fdy;
      sums[p].yy += n * fdy * fdy;
      sums[p].w += sw;
      sums[p].xw += sxw;
      sums[p].yw += sw * fdy;
    }
  }
  [[unroll]] for (int p = 0; p < 4; ++p) {
    found[p] = NormalOf(sums[p], middle[p], float(4 * group + p), float(y));
  }
}

void StoreNormals(int group, int y, vec3 found[4]) {
  const int width = int(params.width_px);
  const int first = 3 * (y * width + 4 * group);
  if (kWholeTexels) {
    normals[first >> 2] = vec4(found[0], found[1].x);
    normals[(first >> 2) + 1] = vec4(found[1].yz, found[2].xy);
    normals[(first >> 2) + 2] = vec4(found[2].z, found[3]);
  } else {
    [[unroll]] for (int i = 0; i < 12; ++i) {
      if (4 * group + i / 3 < width) normals[(first + i) >> 2][(first + i) & 3] = found[i / 3][i % 3];
    }
  }
}
