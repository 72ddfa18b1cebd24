// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/export.h"
#include "mono3d/image/keyframe.h"

namespace MONO3D_EXPORT mono3d {

// The keyframe as if all lines of its image had been read with the middle one: image and
// sparse_pixels are moved, frame.sensor has no shutter. How far a translation moves a pixel follows
// from its depth, which is taken from the sparse points, smoothly over the image: at an edge of
// depth nothing is torn, and what is left there is the share of the way by which the two depths
// differ. Without sparse points rotation alone is corrected. The border is repeated where the image
// ends. Where there is nothing to correct the image is the same one, not a copy. Throws Error when
// there are sparse_pixels, but not one for each of sparse_depths_su.
Keyframe WithGlobalShutter(const Keyframe& keyframe);

}  // namespace mono3d
