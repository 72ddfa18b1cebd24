// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Combines the costs of the sources before and after the reference. A point that is hidden from one
// side is usually visible from the other (Kang, Szeliski and Chai 2001): where one side is worse by
// more than noise, the better one counts. Elsewhere their mean counts, which has less noise than
// either; the smaller of the two would favour chance matches.
//
// The including shader declares kInvalidCost, of a side that does not see the point.

layout(constant_id = 1) const uint kSideTolerance = 16u;  // PlaneSweepOptions::side_tolerance

uint BothSides(uint before, uint after) {
  const uint better = min(before, after);
  const uint worse = max(before, after);
  return better + (worse == kInvalidCost ? 0u : min((worse - better) >> 1, kSideTolerance));
}

// Of four pixels that the same sources see.
uvec4 BothSides(uvec4 before, uvec4 after) {
  const uvec4 better = min(before, after);
  const uvec4 worse = max(before, after);
  return better + (worse.x == kInvalidCost ? uvec4(0) : min((worse - better) >> 1, uvec4(kSideTolerance)));
}
