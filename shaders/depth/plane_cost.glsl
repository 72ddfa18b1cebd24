// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Matching cost of a pixel of the reference on a plane, by the census transforms of five images: the
// Hamming distances are added over the two sources before the reference and over the two after it,
// each side normalised by its number of valid projections, and the smaller side counts: what hides a
// point from one side seldom hides it from the other (Kang, Szeliski and Chai 2001).
// A cost is twice the mean distance, 0 to 124; kInvalidCost where no source sees the point.
//
// The including shader declares the rg32ui binding `census`: of the reference, then per source of its
// positions_per_px^2 images (census.comp).

const uint kInvalidCost = 255u;

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

// Sums of the bits of each pair, then of each four.
uint PairSums(uint bits) { return bits - ((bits >> 1) & 0x55555555u); }
uint NibbleSums(uint pairs) { return (pairs & 0x33333333u) + ((pairs >> 2) & 0x33333333u); }

// Of two sources: the sum of their Hamming distances, or twice that of the one that sees the point.
uint SideCost(View a, View b) {
  const uvec2 first = a.visible ? a.difference : b.difference;
  const uvec2 second = b.visible ? b.difference : a.difference;
  // Three of the four words as sum and carry: a full adder in each bit.
  const uint sum = first.x ^ first.y ^ second.x;
  const uint carry = (first.x & first.y) | (second.x & (first.x ^ first.y));
  const uint ones = NibbleSums(PairSums(sum)) + NibbleSums(PairSums(second.y));  // up to 8
  const uint twos = NibbleSums(PairSums(carry));
  const uint bytes = (ones & 0x0f0f0f0fu) + ((ones >> 4) & 0x0f0f0f0fu) +
                     2u * ((twos & 0x0f0f0f0fu) + ((twos >> 4) & 0x0f0f0f0fu));
  return a.visible || b.visible ? (bytes * 0x01010101u) >> 24 : kInvalidCost;
}

// Of the four sources, in the order of flight.
uint CostOf(View first, View second, View third, View fourth) {
  return min(SideCost(first, second), SideCost(third, fourth));
}
