// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Matching cost of a pixel of the reference on a plane, by the census transforms of five images: the
// Hamming distances are added over the two sources before the reference and over the two after it,
// each side normalised by its number of valid projections, and the smaller side counts: what hides a
// point from one side seldom hides it from the other (Kang, Szeliski and Chai 2001).
// A cost is twice the mean distance, 0 to 124; kInvalidCost where no source sees the point.
//
// The including shader declares the bindings `census`, of the reference, then per source of its
// positions_per_px^2 images (census.comp), and `projections`, per source 12 numbers: a row-major 3x3
// matrix A and a vector b; the pixel p = (x, y, 1) on the plane of inverse depth w is seen at
// A p + w b (homogeneous).

const uint kInvalidCost = 255u;
const uint kNoProjection = 1024u;  // flag added to a Hamming distance

vec3 a0, a1, a2, a3;  // A p of each source
vec3 b0, b1, b2, b3;
uint reference_low, reference_high;
int census_words;  // of one half of one image
int stride_px;
ivec2 last;  // positions in a source: 0 .. last
int shift;   // 1 when there are half-pixel positions

vec3 LoadVector(int first, int step) {
  return vec3(imageLoad(projections, first).x, imageLoad(projections, first + step).x,
              imageLoad(projections, first + 2 * step).x);
}

// Once for a pixel, before Cost.
void PreparePixel(int x, int y, uint width_px, uint height_px, uint positions_per_px) {
  stride_px = 4 * (int(width_px + 3u) / 4);
  census_words = stride_px * int(height_px);
  last = ivec2(positions_per_px * (width_px - 1u), positions_per_px * (height_px - 1u));
  shift = int(positions_per_px) - 1;
  const int here = y * stride_px + x;
  reference_low = imageLoad(census, here).x;
  reference_high = imageLoad(census, here + census_words).x;
  // In positions instead of pixels: the first two coordinates times positions_per_px.
  const float positions = float(positions_per_px);
  const vec3 scale = vec3(positions, positions, 1);
  const vec3 p = vec3(x, y, 1);
  a0 = scale * (mat3(LoadVector(0, 3), LoadVector(1, 3), LoadVector(2, 3)) * p);
  a1 = scale * (mat3(LoadVector(12, 3), LoadVector(13, 3), LoadVector(14, 3)) * p);
  a2 = scale * (mat3(LoadVector(24, 3), LoadVector(25, 3), LoadVector(26, 3)) * p);
  a3 = scale * (mat3(LoadVector(36, 3), LoadVector(37, 3), LoadVector(38, 3)) * p);
  b0 = scale * LoadVector(9, 1);
  b1 = scale * LoadVector(21, 1);
  b2 = scale * LoadVector(33, 1);
  b3 = scale * LoadVector(45, 1);
}

// Hamming distance, or kNoProjection.
uint Distance(vec3 at, int source) {
  const float scale = 1.0 / at.z;
  const int x = int(floor(at.x * scale + 0.5));
  const int y = int(floor(at.y * scale + 0.5));
  const bool visible = at.z > 0.0 && x >= 0 && y >= 0 && x <= last.x && y <= last.y;
  const int image = 1 + (source << (2 * shift)) + (((y & shift) << 1) | (x & shift));
  const int index =
      visible ? 2 * image * census_words + (y >> shift) * stride_px + (x >> shift) : 0;
  const uint low = imageLoad(census, index).x;
  const uint high = imageLoad(census, index + census_words).x;
  const uint distance =
      uint(bitCount(low ^ reference_low)) + uint(bitCount(high ^ reference_high));
  return visible ? distance : kNoProjection;
}

uint SideCost(uint first, uint second) {
  const uint sum = first + second;
  return sum < kNoProjection ? sum : 2u * (min(first, second));
}

uint Cost(float w) {
  const uint before = SideCost(Distance(a0 + w * b0, 0), Distance(a1 + w * b1, 1));
  const uint after = SideCost(Distance(a2 + w * b2, 2), Distance(a3 + w * b3, 3));
  return min(min(before, after), kInvalidCost);
}
