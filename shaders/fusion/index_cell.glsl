// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The cell of the index map onto which a surfel falls, from where it is and which way it looks in
// the camera's frame. After view.glsl.

const uint kNoCell = 0xFFFFFFFFu;

// kNoCell behind the camera, beyond the image, and for a surfel that faces away.
uint IndexCellOf(vec3 p_cam, vec3 n_cam) {
  if (p_cam.z <= 0.0 || Dot(n_cam, p_cam) >= 0.0) return kNoCell;
  precise vec2 cell = floor((Project(p_cam) + 0.5) * float(kIndexCellsPerPixel));
  const uint width = params.width_px * kIndexCellsPerPixel;
  const uint height = params.height_px * kIndexCellsPerPixel;
  if (any(lessThan(cell, vec2(0.0))) || cell.x >= float(width) || cell.y >= float(height)) {
    return kNoCell;
  }
  return uint(cell.y) * width + uint(cell.x);
}
