// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fusion/corrector.h"
#include "fusion/deformation.h"
#include "fusion/depth_map_buffers.h"
#include "fusion/fusion_stages.h"
#include "fusion/model_parts.h"
#include "fusion/past_views.h"
#include "fusion/placed_depth_map.h"
#include "fusion/registration.h"
#include "fusion/repairing_surfel_map.h"
#include "fusion/selection.h"
#include "fusion/surfel_blocks.h"
#include "fusion/surfel_export.h"
#include "fusion/surfel_storage.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {

// Around the image, so that no rounding matters at its border.
inline constexpr std::uint32_t kViewMargin_px = 1;

// The model on the device: the order in which the stages run, and what it remembers from one depth
// map to the next.
class VulkanSurfelMap : public RepairableMap {
 public:
  VulkanSurfelMap(std::shared_ptr<Device> device, const SurfelMapOptions& options,
                  StageTimes* times)
      : device_(std::move(device)),
        options_(options),
        times_(times),
        stages_(device_),
        registrar_(device_),
        corrector_(device_),
        recorder_(device_),
        culler_(device_),
        surfels_(device_, static_cast<std::uint32_t>(options.max_surfels)),
        past_views_(static_cast<std::size_t>(options.num_reviews)) {}

  FusionResult Integrate(const DepthMap& map, const KeyframePoses& poses) override;
  UpdateResult Update(const KeyframePoses& poses) override;
  std::vector<FusedDepthMap> DepthMaps() const override;
  std::uint32_t num_depth_maps() const override { return num_depth_maps_; }
  void TakeOut(std::uint32_t first_depth_map) override;
  int num_submaps() const override { return static_cast<int>(Submaps(views_).size()); }
  std::optional<UpdateResult> Join(SurfelMap& other, const KeyframePoses& poses) override;
  void Rest() override;

  using SurfelMap::Export;
  PointCloud Export(const SurfelExportOptions& options) const override {
    return ToPointCloud(surfels_.Download(), options);
  }

  std::int64_t num_surfels() const override {
    return std::int64_t{surfels_.size()} - surfels_.num_removed();
  }

 private:
  ViewParams ViewOf(const PlacedDepthMap& placed) const;
  FusionResult Rejected(const Similarity& S_world_kf, std::string reason) const;
  void Upload(const PlacedDepthMap& placed, const PackedDepthMap& packed);
  Predictions Predict(const Similarity& S_world_kf) const;
  std::optional<int> MapIdBy(const KeyframePoses& poses) const;
  // Where a depth map goes.
  struct Placement {
    Registration registration;
    int submap = 0;
    bool starts_submap = false;
    std::optional<SubmapJoin> join;
    std::vector<KeyframeConstraint> constraints;
  };
  // What one submap makes of it.
  struct SubmapRegistration {
    int submap = 0;
    Registration registration;
  };
  Placement Place(const DepthMap& map, const Similarity& S_world_kf);
  Registration Register(const DepthMap& map, const Predictions& predictions,
                        const BlockList& blocks);
  std::vector<SubmapRegistration> RegisterWithSubmaps(const DepthMap& map,
                                                      const Predictions& predictions);
  std::optional<SubmapJoin> JoinSubmaps(const DepthMap& map, std::vector<SubmapRegistration>& shown,
                                        std::vector<KeyframeConstraint>& constraints);
  void MoveToOldest(const DepthMap& map, const SubmapRegistration& other,
                    const SubmapRegistration& oldest, SubmapJoin& join);
  std::int64_t MergeAcross(const std::vector<bool>& is_other);
  void AddView(const FusedView& view);
  std::int64_t Append(VulkanSurfelMap& other);
  std::uint32_t Associate(const ViewParams& params, int submap);
  std::uint32_t ChangeSurfels(ViewParams params, std::uint32_t num_new);
  void ReviewNew(std::uint32_t first_surfel, std::uint32_t num_surfels);
  bool MakeRoom(std::uint32_t num_new);
  bool Coarsen();
  void Resize(const CameraModel& camera);
  void FindVisible(std::span<const ViewParams> views, std::uint32_t margin_px);
  std::int64_t MergeOverlaps(std::span<const std::size_t> views);
  std::uint32_t MergeOverlap(const FusedView& view);

  std::shared_ptr<Device> device_;
  SurfelMapOptions options_;
  StageTimes* times_;
  FusionStages stages_;
  Registrar registrar_;
  Corrector corrector_;
  Recorder recorder_;
  BlockCuller culler_;
  SurfelStorage surfels_;
  BlockList visible_;  // what the stages work on
  BlockList latest_;   // what the last depth map has added
  BlockList of_submap_;
  DepthMapBuffers buffers_;
  PastViews past_views_;
  std::uint32_t merge_radius_px_ = 1;
  int width_px_ = 0;
  int height_px_ = 0;
  std::vector<FusedView> views_;      // of the depth maps in the model
  std::optional<int> map_id_;         // of the tracker's map that the model shows
  bool tracker_drifted_ = false;      // the last depth map was not where the tracker put it
  std::uint32_t num_depth_maps_ = 0;  // fused so far
};

}  // namespace mono3d
