// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Surfaces are inferred on maps of half the resolution and coarser ones, rgba32f. Data: inverse
// depth that was matched, its weight, its confidence, and the grey value. State: inverse depth,
// confidence, and the grey value. Host side: depth/inference.h.
//
// Between two neighbours inverse depth is held together by a conductance, which grey values that
// differ lower: 1 on one grey value, a quarter at kEdge grey levels of difference. The least keeps
// parts without any data connected.
const float kEdge = 6.0;
const float kLeastConductance = 1e-3;

float Conductance(float grey, float other) {
  const float edges = (grey - other) / kEdge;
  const float share = 1.0 / (1.0 + edges * edges);
  return max(share * share, kLeastConductance);
}

// What is known of cells of 4x4 pixels: of a plane there the inverse depth in the middle of the
// cell, its slopes along x and y, and the confidence; 0: no plane, below 0: sky; where the plane is
// believed whatever the winners of its pixels are, 1 more. Where no plane is known, and the cell was
// matched on a coarser level alone: its inverse depth, the step between planes of that level, and the
// confidence.
int CellAt(int x, int y, uint width_px) { return (y >> 2) * int((width_px + 3u) >> 2) + (x >> 2); }

bool IsBelieved(vec4 cell) { return cell.w > 1.0; }

bool IsMatchedCoarsely(vec4 cell) { return cell.w == 0.0 && cell.y > 0.0; }

float ConfidenceOf(vec4 cell) { return IsBelieved(cell) ? cell.w - 1.0 : cell.w; }
