// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "fusion/export.h"
#include "fusion/health.h"
#include "fusion/kept_maps.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {

// A model whose latest part can be taken out again.
class RepairableMap : public SurfelMap {
 public:
  virtual std::uint32_t num_depth_maps() const = 0;
  // Removes the depth maps from the given one on, and the surfels anchored to them. What they added
  // to surfels of earlier ones stays.
  virtual void TakeOut(std::uint32_t first_depth_map) = 0;
  // Parts that hang together by the tracker's poses alone.
  virtual int num_submaps() const = 0;
  // Merges what corrections have laid upon each other and no depth map has shown since.
  virtual void MergePending() = 0;
  // For ToPointCloud; needs nothing of the model any more.
  virtual ChosenSurfels Choose(const SurfelExportOptions& options) const = 0;
};

// A model that tries depth maps again which did not fit, knows how it is, and when it refuses
// rather more than it takes lets the majority decide: its latest part is taken out, what was
// refused goes in first, and what was there before must fit that.
class RepairingSurfelMap : public SurfelMap {
 public:
  RepairingSurfelMap(std::unique_ptr<RepairableMap> model, const SurfelMapOptions& options);

  FusionResult Integrate(const DepthMap& map, const KeyframePoses& poses) override;
  UpdateResult Update(const KeyframePoses& poses) override { return model_->Update(poses); }
  std::optional<UpdateResult> Join(SurfelMap& other, const KeyframePoses& poses) override;
  std::vector<FusedDepthMap> DepthMaps() const override { return model_->DepthMaps(); }
  SurfelChanges ChangesSince(std::uint64_t version) override {
    return model_->ChangesSince(version);
  }
  void Rest() override;
  void SaveState(StateFolder& folder, const std::string& name) override;
  void RestoreState(const StateFolder& folder, const std::string& name) override;
  using SurfelMap::Export;
  PointCloud Export(const SurfelExportOptions& options) const override {
    model_->MergePending();
    return model_->Export(options);
  }
  PointCloud ExportLast(const SurfelExportOptions& options) override;
  std::int64_t num_surfels() const override { return model_->num_surfels(); }

 private:
  void Keep(KeptMap kept, FusionResult& result);
  RetriedMap TryAgain(KeptMap kept, const KeyframePoses& poses, FusionResult& all);
  void Repair(const KeyframePoses& poses, FusionResult& result);
  template <typename Archive>
  void Exchange(Archive& archive);

  std::unique_ptr<RepairableMap> model_;
  SurfelMapOptions options_;
  HealthMonitor health_;
  int num_since_repair_;  // depth maps; a repair is given time to show
  KeptMaps waiting_;
  KeptMaps recent_;
};

}  // namespace mono3d
