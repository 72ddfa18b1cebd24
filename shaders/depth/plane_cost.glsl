// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Matching cost of a pixel of the reference on a plane, by the census transforms of five images: the
// Hamming distances are added over the two sources before the reference and over the two after it,
// each side normalised by its number of valid projections, and the smaller side counts: what hides a
// point from one side seldom hides it from the other (Kang, Szeliski and Chai 2001).
// A cost is twice the mean distance, 0 to 124; kInvalidCost where no source sees the point.
//
// The including shader declares the binding `census`: of the reference, then per source of its
// positions_per_px^2 images (census.comp).

const uint kInvalidCost = 255u;
const uint kNoProjection = 1024u;  // flag added to a Hamming distance

uvec2 reference;   // census of the pixel
int census_words;  // of one half of one image

// Of the census at a word of a first half.
uint HammingDistance(int index) {
  return uint(bitCount(imageLoad(census, index).x ^ reference.x)) +
         uint(bitCount(imageLoad(census, index + census_words).x ^ reference.y));
}

void LoadReference(int index) {
  reference = uvec2(imageLoad(census, index).x, imageLoad(census, index + census_words).x);
}

uint SideCost(uint first, uint second) {
  const uint sum = first + second;
  return sum < kNoProjection ? sum : 2u * (min(first, second));
}

// Of the Hamming distances of the four sources, in the order of flight.
uint CostOf(uint first, uint second, uint third, uint fourth) {
  return min(min(SideCost(first, second), SideCost(third, fourth)), kInvalidCost);
}
