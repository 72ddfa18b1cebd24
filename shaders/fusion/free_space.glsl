// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What this map says against a surfel. Each map that sees through it counts by its confidence. Maps
// in which it lies hidden behind a surface count as one at most: things do hide each other, but a
// surface that one map alone has seen is rather a mistake when another sees something before it.
// A surfel is removed (its weight becomes 0) when as much speaks against it as for it: what sees
// through it, and for a surfel of a single map also what hides it. A map of the past removes none:
// it may be the one that is wrong, and the next map will tell.

// Whether the map that said this of a surfel speaks against it; if so, its history afterwards.
bool SpeaksAgainst(uint said, inout uvec4 history) {
  if (!Says(said, kSeenThrough) && !Says(said, kHidden)) return false;
  const uint confidence = said & 0xFFu;  // in 1/255
  uint seen_through = (history.y >> 16) & 0xFFu;
  uint hidden = history.y >> 24;
  if (Says(said, kSeenThrough)) {
    seen_through = min(seen_through + (8u * confidence + 127u) / 255u, 255u);
  } else {
    hidden = min(hidden + confidence, 255u);
  }
  history.y = Low16(history.y) | (seen_through << 16) | (hidden << 24);
  return true;
}

// Whether as much speaks against a surfel as for it.
bool IsRefuted(uvec4 history) {
  uint against = SeenThroughAgainst(history.y);
  if (Low16(history.y) == 1u) against += HiddenAgainst(history.y);
  return against >= High16(history.w);
}
