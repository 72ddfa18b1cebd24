// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/fusion/fusion_reference.h"
#include "reference/fusion/view_reference.h"

namespace mono3d::reference {
namespace {

std::uint32_t EvidenceAgainst(const ViewParams& view, const PackedDepthMap& map,
                              const Candidates& candidates, std::size_t pixel, float inverse_depth,
                              float weight, bool faces_away) {
  const std::size_t x = pixel % view.width_px;
  const std::size_t y = pixel / view.width_px;
  if (x < 1 || y < 1 || x + 1 >= view.width_px || y + 1 >= view.height_px) return kUnseen;
  int num_past = 0;
  int num_before = 0;
  float confidence = 1;
  for (std::size_t row = y - 1; row <= y + 1; ++row) {
    for (std::size_t col = x - 1; col <= x + 1; ++col) {
      const float z = map.depth[row * view.width_px + col];
      if (z <= 0) return kUnseen;
      const float sigma = JointSigma(view, 1 / z, inverse_depth, weight);
      num_past += inverse_depth - 1 / z > view.free_space_sigmas * sigma ? 1 : 0;
      num_before += 1 / z - inverse_depth > view.free_space_sigmas * sigma ? 1 : 0;
      confidence = std::min(confidence, candidates[row * view.width_px + col][3]);
    }
  }
  const auto steps = static_cast<std::uint32_t>(std::lround(confidence * 255));
  if (num_past == 9) return kSeenThrough | steps;
  return num_before == 9 && !faces_away ? kHidden | steps : kUnseen;
}

std::uint32_t AssociateOne(const ViewParams& view, const AnchorTransforms& anchors,
                           const PackedDepthMap& map, const Candidates& candidates,
                           const Surfels& surfels, std::size_t i) {
  if (IsRemoved(surfels, i)) return kUnseen;
  const CameraFromAnchor to_camera = FromAnchorOf(anchors, surfels, i);
  const float weight = to_camera.Weight(surfels.normal_weight[i][3]);
  const Vector3f p_cam = to_camera.Point(Head(surfels.position_radius[i]));
  const auto pixel = CellOf(view, p_cam, 1);
  if (!pixel || candidates[*pixel][3] <= 0) return kUnseen;

  const Vector3f measured_normal = Head(candidates[*pixel]);
  const float measured = 1 / map.depth[*pixel];
  const float inverse_depth = 1 / p_cam.z();
  const Vector3f ray(p_cam.x() / p_cam.z(), p_cam.y() / p_cam.z(), 1);
  const Vector3f pixel_ray = Ray(view, static_cast<float>(*pixel % view.width_px),
                                 static_cast<float>(*pixel / view.width_px));
  const float expected = TangentPlaneInverseDepth(measured_normal, pixel_ray, measured, ray);
  const float sigma = JointSigma(view, measured, inverse_depth, weight);
  const Vector3f normal = to_camera.Direction(Head(surfels.normal_weight[i]));
  if (std::abs(inverse_depth - expected) <= view.association_sigmas * sigma) {
    const bool same = Dot(normal, measured_normal) >= view.min_normal_cosine;
    return same ? static_cast<std::uint32_t>(*pixel) : kUnseen;
  }
  return EvidenceAgainst(view, map, candidates, *pixel, inverse_depth, weight,
                         Dot(normal, p_cam) >= 0);
}

}  // namespace

std::vector<std::uint32_t> Associate(const ViewParams& view, const AnchorTransforms& anchors,
                                     const PackedDepthMap& map, const Candidates& candidates,
                                     const Surfels& surfels) {
  std::vector<std::uint32_t> association;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    association.push_back(AssociateOne(view, anchors, map, candidates, surfels, i));
  }
  return association;
}

}  // namespace mono3d::reference
