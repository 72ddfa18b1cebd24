// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "fusion/depth_map_buffers.h"
#include "fusion/kernels.h"
#include "fusion/storage.h"
#include "fusion/tracked_model.h"
#include "fusion/view.h"
#include "gpu/recorder.h"
#include "reference/fusion/fusion_reference.h"

namespace mono3d {

// Points p of a plane: normal.p = offset. The normal points to where it can be seen from.
struct Plane {
  Eigen::Vector3d normal{0, 0, -1};
  double offset_su = -10;
};

// Width w, height h, focal length w: some 53 degrees wide.
CameraModel TestCamera(int width_px, int height_px);

// The exact depth map of a plane, in grey 100, with a baseline of a tenth of 10 su.
TrackedMap PlaneMap(const CameraModel& camera, const Pose& T_world_cam, const Plane& plane = {});

// Multiplies inverse depths by 1 + uniform noise of +-`amount`, takes every `nth_missing` pixel
// away (0: none), and paints at random.
void Disturb(TrackedMap& map, double amount, int nth_missing, unsigned seed);

// A camera that has moved sideways and turned a little: most of a scene 10 su away is still in
// view.
Pose MovedPose();

// The same surfels in a unit of which so many are one of theirs.
Surfels InUnit(const Surfels& surfels, double per_su);

// A model of one depth map that meets a second one, on the device and for the references. The
// second sees past most of a wall that the first has seen. Its anchor has a unit of its own.
class StageScene {
 public:
  StageScene(int width_px, int height_px, unsigned seed);
  // A model of the given surfels that meets `map`. Anchors are in the world's frame, unless
  // `S_world_anchor` says where.
  StageScene(const TrackedMap& map, const Surfels& surfels, const SurfelMapOptions& options = {},
             const std::vector<Similarity>& S_world_anchor = std::vector<Similarity>(16));

  // Runs the stages of FusionKernels up to and with the named one, in order.
  void RunPrepare() { kernels.Prepare(recorder, view, buffers), recorder.Submit(); }
  void RunAssociate();
  void RunIndexMap();
  void RunSelectNew();

  reference::Candidates DeviceCandidates() const;
  std::vector<std::uint32_t> DeviceAssociation() const;
  std::vector<reference::IndexCell> DeviceIndexMap() const;
  std::vector<std::uint32_t> DeviceSelected() const;

  ViewParams view;
  reference::AnchorTransforms anchors;  // as the depth map's camera has them
  AnchorTable anchor_table;
  PackedDepthMap packed;
  Surfels surfels;  // of the model, as uploaded
  Recorder recorder;
  FusionKernels kernels;
  DepthMapBuffers buffers;
  SurfelStorage storage;
  BlockList all_blocks;

 private:
  void Upload(const TrackedMap& map);
};

// One surfel at a point of the world, seen by one depth map.
Surfels OneSurfel(const Eigen::Vector3f& p_world, const Eigen::Vector3f& normal, float weight);
void Append(Surfels& surfels, const Surfels& more);

// Share of the elements in which two lists of one length differ.
template <typename T>
double DifferingShare(const std::vector<T>& a, const std::vector<T>& b) {
  if (a.size() != b.size()) return 1;
  std::size_t different = 0;
  for (std::size_t i = 0; i < a.size(); ++i) different += a[i] == b[i] ? 0 : 1;
  return a.empty() ? 0 : static_cast<double>(different) / static_cast<double>(a.size());
}

}  // namespace mono3d
