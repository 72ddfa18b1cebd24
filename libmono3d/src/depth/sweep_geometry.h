// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "depth/padded_image.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/image/image_bundle.h"

namespace mono3d {

// The first and the last pixel of an image that show something; by default all.
struct PixelBounds {
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Vector2d last = Eigen::Vector2d::Constant(1e6);

  bool Contain(const Eigen::Vector2d& pixel) const {
    return (pixel.array() >= first.array()).all() && (pixel.array() <= last.array()).all();
  }
};

// Of an image halved `level` times: the pixels that are made of none from outside the content.
PixelBounds BoundsOfContent(const Frame& frame, int level);

// Where a source sees the pixel p = (x, y, 1) of the reference on the plane of inverse depth w:
// at (A p + w b), homogeneous. The homography of the plane is A + w b (0 0 1).
struct SourceProjection {
  Eigen::Matrix3d A;
  Eigen::Vector3d b;
  PixelBounds bounds = {};     // of the source
  PixelBounds reference = {};  // the same of the reference, for all sources
  // By which the source's picture is turned against the reference's: T_src_ref in quarters of a
  // turn about the optical axis, rounded.
  unsigned quarter_turns = 0;

  // Does the source see the point of this pixel, and of this inverse depth?
  bool Sees(const Eigen::Vector2d& pixel, double inverse_depth) const {
    const Eigen::Vector3d at = A * pixel.homogeneous() + inverse_depth * b;
    return at.z() > 0 && bounds.Contain(at.hnormalized());
  }
};

// Of the sources, the images other than the reference: the first half is one side of the bundle,
// the other half is the other one. Where one side has fewer images than the other, the rest of its
// half are sources that see nothing.
using SourceProjections = std::vector<SourceProjection>;
inline constexpr std::size_t kMaxSources = kMaxBundleSize - 1;

// Of each source its index in the bundle; none for one that sees nothing.
std::vector<std::optional<std::size_t>> IndicesOfSources(const ImageBundle& bundle);

// Inverse depths in 1/su; 0 <= farthest < nearest.
struct InverseDepthRange {
  double farthest = 0;
  double nearest = 0;
};

// The sources around the reference of a bundle, as the sweep sees them at full resolution.
class SweepGeometry {
 public:
  explicit SweepGeometry(const ImageBundle& bundle);

  const CameraModel& camera() const { return camera_; }  // of the reference
  // Of the reference halved `level` times.
  const PixelBounds& bounds(int level) const { return bounds_[static_cast<std::size_t>(level)]; }
  std::size_t num_sources() const { return projections_.size(); }
  double largest_baseline_su() const { return largest_baseline_su_; }
  // False when the cameras stand in one place.
  bool HasBaseline() const { return largest_baseline_su_ > 0; }

  // For images halved `level` times.
  SourceProjections Projections(int level) const;

  // Largest share of the reference that one source sees on the plane.
  double VisibleShare(double inverse_depth) const;

  // The largest |d pixel / d inverse depth| over the sources, a grid of pixels and the range, in
  // px * su at full resolution. Points that a source sees at less than half the depth in the
  // reference are left out. 0 when no source sees any of the points, and without a baseline.
  double PixelsPerInverseDepth(const InverseDepthRange& range) const;

  // From infinity to the nearest plane on which a source still sees half of the reference's pixels.
  // Empty when there is no baseline or no such plane.
  std::optional<InverseDepthRange> WidestRange() const;

 private:
  CameraModel camera_;
  std::vector<PixelBounds> bounds_;  // of the reference, at each level
  std::vector<CameraModel> source_cameras_;
  std::vector<std::vector<PixelBounds>> source_bounds_;  // at each level
  SourceProjections projections_;
  double largest_baseline_su_ = 0;
};

// The camera of an image halved `level` times: c' = (c + 0.5) / 2 - 0.5, f' = f / 2, sizes rounded
// up.
CameraModel HalvedCamera(CameraModel camera, int level);

// As the kernels read them: the bounds of the reference, then per source A in rows, b, and its
// bounds, all within images of `size`.
inline constexpr std::size_t kMaxProjectionBytes = (4 + 16 * kMaxSources) * sizeof(float);
std::vector<float> Pack(const SourceProjections& projections, const LevelSize& size);

// The quarter turns of the reference (none) and of the sources, as shaders/depth/census.glsl reads
// them.
std::uint32_t PackQuarterTurns(const SourceProjections& projections);

// Range of inverse depths that holds nearly all of the scene, from a sample of its depths: their 2
// % and 98 % quantiles with a margin. Empty for fewer than 25 depths that are finite and positive.
std::optional<InverseDepthRange> RangeOfDepths(const std::vector<float>& depths_su);

}  // namespace mono3d
