// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Matching cost of a pixel of the reference on a plane, from the census transforms of the images:
// the Hamming distances are summed over the sources before the reference and over those after it,
// each side is normalised by its number of valid projections, and the two sides are combined
// (both_sides.glsl). A cost is twice the mean distance, 0 to 124; kInvalidCost where no source sees
// the point.
//
// The including shader includes depth/sources.glsl and declares the rg32ui binding `census`: of the
// reference, then of each source (census.comp).

const uint kInvalidCost = 255u;

#include "depth/both_sides.glsl"

uvec2 reference;    // census of the pixel
int census_pixels;  // of one image

void LoadReference(int index) { reference = imageLoad(census, index).xy; }

// A source's view of a pixel on a plane: where its census differs from the reference's.
struct View {
  bool visible;
  uvec2 difference;
};

// `index` is that of the pixel among those of all images; any when it is not visible.
View ViewOf(bool visible, int index) {
  return View(visible, imageLoad(census, visible ? index : 0).xy ^ reference);
}

uint NumBits(uvec2 words) {
  const ivec2 bits = bitCount(words);
  return uint(bits.x + bits.y);
}

// Of one or two sources: the sum of their Hamming distances, or twice that of the one that sees the
// point.
uint CostOfTwo(View a, View b) {
  const uvec2 first = a.visible ? a.difference : b.difference;
  const uvec2 second = b.visible ? b.difference : a.difference;
  return a.visible || b.visible ? NumBits(first) + NumBits(second) : kInvalidCost;
}

// Of three or four: twice the mean of those that see the point, rounded. At most 4 * 62 bits.
uint CostOfMore(View a, View b, View c, View d) {
  const uvec2 none = uvec2(0);
  const uint sum =
      NumBits(a.visible ? a.difference : none) + NumBits(b.visible ? b.difference : none) +
      NumBits(c.visible ? c.difference : none) + NumBits(d.visible ? d.difference : none);
  const int num_visible = int(a.visible) + int(b.visible) + int(c.visible) + int(d.visible);
  const float doubled_share = num_visible == 4   ? 0.5
                              : num_visible == 3 ? 2.0 / 3.0
                              : num_visible == 2 ? 1.0
                                                 : 2.0;
  const uint cost = uint(float(sum) * doubled_share + 0.5);
  return num_visible > 0 ? cost : kInvalidCost;
}

// Of the sources from `first` on.
uint SideCost(View views[kMaxSources], int first) {
  const View last = views[first + kSourcesPerSide - 1];
  if (kSourcesPerSide <= 2) return CostOfTwo(views[first], last);
  const View none = View(false, uvec2(0));
  return CostOfMore(views[first], views[first + 1], last,
                    kSourcesPerSide > 3 ? views[first + 2] : none);
}

uint CostOf(View views[kMaxSources]) {
  return BothSides(SideCost(views, 0), SideCost(views, kSourcesPerSide));
}
