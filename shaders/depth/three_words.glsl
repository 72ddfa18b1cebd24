// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Some words in a row of a buffer of four-word texels: two texels and a choice are faster than
// loads of single words where the lanes' loads are gathered. The including shader declares the
// rgba32ui binding and defines WORDS as its name.

// Words `first` .. `first` + 2 of a buffer; `a` is the texel of the first, `b` that of the last.
uvec3 CutThreeWords(uvec4 a, uvec4 b, int first) {
  const bool by1 = (first & 1) != 0;
  const uvec4 pairs = (first & 2) != 0 ? uvec4(a.zw, b.xy) : a;
  return by1 ? pairs.yzw : pairs.xyz;
}

// Words `first` .. `first` + 2.
uvec3 ThreeWords(int first) {
  return CutThreeWords(imageLoad(WORDS, first >> 2), imageLoad(WORDS, (first + 2) >> 2), first);
}

// Words `first` .. `first` + 3.
uvec4 FourWords(int first) {
  const uvec4 a = imageLoad(WORDS, first >> 2);
  const uvec4 b = imageLoad(WORDS, (first + 3) >> 2);
  const bool by1 = (first & 1) != 0;
  const bool by2 = (first & 2) != 0;
  const uvec4 even = by2 ? uvec4(a.zw, b.xy) : a;
  return by1 ? uvec4(even.yzw, by2 ? b.z : b.x) : even;
}

// Word `place` of a buffer, which lies in `texel`.
uint CutWord(uvec4 texel, int place) {
  const uvec2 pair = (place & 2) != 0 ? texel.zw : texel.xy;
  return (place & 1) != 0 ? pair.y : pair.x;
}
