// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// How many images a pixel of the reference is matched with. The number is a specialisation
// constant: loops over the sources unroll, and what is kept of each stays in registers.

layout(constant_id = 0) const int kSourcesPerSide = 2;  // of the reference, 1 to 4
const int kNumSources = 2 * kSourcesPerSide;            // of one side, then of the other
const int kMaxSources = 8;
