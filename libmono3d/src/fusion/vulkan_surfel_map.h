// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fusion/change_log.h"
#include "fusion/depth_map_fuser.h"
#include "fusion/fusion_context.h"
#include "fusion/part_merger.h"
#include "fusion/registration/depth_map_placer.h"
#include "fusion/retry.h"
#include "fusion/surfel_map_state.h"
#include "fusion/vignetting.h"

namespace mono3d {

// The model on the device: the order in which its parts work on a depth map.
class VulkanSurfelMap : public RepairableMap {
 public:
  VulkanSurfelMap(std::shared_ptr<Device> device, const SurfelMapOptions& options,
                  StageTimes* times);

  FusionResult Integrate(const DepthMap& map, const KeyframePoses& poses) override;
  UpdateResult Update(const KeyframePoses& poses) override;
  std::optional<UpdateResult> Join(SurfelMap& other, const KeyframePoses& poses) override;
  std::vector<FusedDepthMap> DepthMaps() const override;
  SurfelChanges ChangesSince(std::uint64_t version) override;
  std::uint32_t num_depth_maps() const override { return model_.anchors.size(); }
  void TakeOut(std::uint32_t first_depth_map) override;
  int num_submaps() const override { return model_.anchors.num_submaps(); }
  void MergePending() override;
  void Rest() override;
  void SaveState(StateFolder& folder, const std::string& name) override;
  void RestoreState(const StateFolder& folder, const std::string& name) override;

  using SurfelMap::Export;
  PointCloud Export(const SurfelExportOptions& options) const override {
    return ToPointCloud(Choose(options));
  }
  ChosenSurfels Choose(const SurfelExportOptions& options) const override;

  std::int64_t num_surfels() const override { return model_.surfels.num_surfels(); }

 private:
  // `map`: what the `whole` one matched, its image without the falloff of the lens.
  FusionResult IntegrateCorrected(const DepthMap& map, const DepthMap& whole,
                                  const KeyframePoses& poses);
  FusionResult Rejected(const Similarity& S_world_kf, FusionRejection rejection,
                        std::string reason) const;
  void CloseGaps();
  std::int64_t Append(VulkanSurfelMap& other);
  SurfelMapParts Parts();

  FusionContext context_;
  SurfelModel model_;
  PartMerger merger_;
  DepthMapPlacer placer_;
  DepthMapFuser fuser_;
  ChangeLog changes_;
  Vignetting vignetting_;      // of the camera
  std::optional<int> map_id_;  // of the tracker's map that the model shows
  SurfelMapState state_;       // what of it is saved
};

}  // namespace mono3d
