// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Three words in a row of a buffer of four-word texels: two texels and a choice are faster than three
// loads of single words where the lanes' loads are gathered. The including shader declares the rgba32ui
// binding and defines WORDS as its name.

// Words `first` .. `first` + 2.
uvec3 ThreeWords(int first) {
  const uvec4 a = imageLoad(WORDS, first >> 2);
  const uvec4 b = imageLoad(WORDS, (first + 2) >> 2);
  const bool by1 = (first & 1) != 0;
  const uvec4 pairs = (first & 2) != 0 ? uvec4(a.zw, b.xy) : a;
  return by1 ? pairs.yzw : pairs.xyz;
}
