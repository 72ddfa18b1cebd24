// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/retry.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "fusion/state_archive.h"
#include "mono3d/core/log.h"

namespace mono3d {

RepairingSurfelMap::RepairingSurfelMap(std::unique_ptr<RepairableMap> model,
                                       const SurfelMapOptions& options)
    : model_(std::move(model)),
      options_(options),
      health_(options.health),
      num_since_repair_(options.health.num_registrations),
      waiting_(options.retry.max_waiting),
      recent_(options.retry.num_recent) {}

FusionResult RepairingSurfelMap::Integrate(const DepthMap& map, const KeyframePoses& poses) {
  FusionResult result = model_->Integrate(map, poses);
  const bool is_fused = result.status == FusionStatus::kFused;
  if (result.registration.registered) health_.Add(result.registration, is_fused);
  if (!options_.registration.enabled) return result;
  if (is_fused || result.registration.registered) {
    Keep({StoredDepthMap(map), 1, 0}, result);
  }
  if (is_fused && !waiting_.empty()) {
    result.retried.push_back(TryAgain(*waiting_.TakeOldest(), poses, result));
    if (result.retried.back().status == FusionStatus::kFused) health_.AcceptLate();
  }
  result.health = health_.Assess();
  ++num_since_repair_;
  if (result.health.state == HealthState::kBroken && waiting_.size() > 1 &&
      num_since_repair_ > options_.health.num_registrations) {
    Repair(poses, result);
  }
  result.health.num_submaps = model_->num_submaps();
  result.num_surfels = num_surfels();
  return result;
}

std::optional<UpdateResult> RepairingSurfelMap::Join(SurfelMap& other, const KeyframePoses& poses) {
  auto* theirs = dynamic_cast<RepairingSurfelMap*>(&other);
  if (theirs == nullptr || theirs == this) return std::nullopt;
  const std::uint32_t num_theirs = theirs->model_->num_depth_maps();
  auto result = model_->Join(*theirs->model_, poses);
  if (!result) return result;
  // Only the latest part of the model can be taken out: from now on that is theirs.
  recent_.Clear();
  const std::uint32_t first_of_theirs = model_->num_depth_maps() - num_theirs;
  theirs->recent_.MoveInto(recent_, first_of_theirs);
  theirs->waiting_.MoveInto(waiting_, first_of_theirs);
  health_ = theirs->health_;
  return result;
}

void RepairingSurfelMap::Rest() {
  waiting_.Clear();
  recent_.Clear();
  model_->Rest();
}

PointCloud RepairingSurfelMap::ExportLast(const SurfelExportOptions& options) {
  waiting_.Clear();
  recent_.Clear();
  model_->MergePending();
  ChosenSurfels chosen = model_->Choose(options);
  model_.reset();
  return ToPointCloud(std::move(chosen));
}

// All but the model and the depth maps that are kept.
template <typename Archive>
void RepairingSurfelMap::Exchange(Archive& archive) {
  health_.Exchange(archive);
  archive.Number(num_since_repair_);
  waiting_.Exchange(archive);
  recent_.Exchange(archive);
}

void RepairingSurfelMap::SaveState(StateFolder& folder, const std::string& name) {
  model_->SaveState(folder, name);
  ByteWriter writer;
  Exchange(writer);
  folder.Put(name + "/retry", writer.TakeBytes());
  const auto put = [&](KeptMaps& kept, const std::string& kind) {
    for (std::size_t i = 0; i < kept.size(); ++i) {
      kept.map(i).Exchange(writer);
      folder.Put(name + kind + std::to_string(i), writer.TakeBytes());
    }
  };
  put(waiting_, "/waiting/");
  put(recent_, "/recent/");
}

void RepairingSurfelMap::RestoreState(const StateFolder& folder, const std::string& name) {
  model_->RestoreState(folder, name);
  const auto read = [&](const std::string& part, auto& value) {
    const std::string bytes = folder.Get(name + part);
    ByteReader reader(bytes, kSavedModel, folder.path().string());
    value.Exchange(reader);
    RequireSound(reader, reader.IsAtEnd());
  };
  read("/retry", *this);
  const auto get = [&](KeptMaps& kept, const std::string& kind) {
    for (std::size_t i = 0; i < kept.size(); ++i) read(kind + std::to_string(i), kept.map(i));
  };
  get(waiting_, "/waiting/");
  get(recent_, "/recent/");
}

// With the others in the model, or with those that wait while they may be tried again.
void RepairingSurfelMap::Keep(KeptMap kept, FusionResult& result) {
  if (result.status == FusionStatus::kFused) {
    kept.map_index = model_->num_depth_maps() - 1;
    recent_.Add(std::move(kept));
  } else if (kept.num_attempts < options_.retry.max_attempts && options_.retry.max_waiting > 0) {
    result.is_waiting = true;
    waiting_.Add(std::move(kept));
  }
}

// What it has brought about besides is added to `all`.
RetriedMap RepairingSurfelMap::TryAgain(KeptMap kept, const KeyframePoses& poses,
                                        FusionResult& all) {
  const DepthMap map = kept.map.Restore();
  // One whose keyframe is no more is given up.
  if (poses.Find(map.keyframe_id) == nullptr) {
    return {.frame_index = map.frame_index, .timestamp_s = map.timestamp_s, .registration = {}};
  }
  FusionResult result = model_->Integrate(map, poses);
  all.submap_joins.insert(all.submap_joins.end(), result.submap_joins.begin(),
                          result.submap_joins.end());
  all.constraints.insert(all.constraints.end(), result.constraints.begin(),
                         result.constraints.end());
  ++kept.num_attempts;
  Keep(std::move(kept), result);
  return {map.frame_index, map.timestamp_s, result.status, result.is_waiting, result.registration};
}

// The depth maps that were refused go in before half as many of those that were taken last: these
// must then fit them, or not come back. Where the refused ones are wrong themselves, the rest of
// the model refuses them again.
void RepairingSurfelMap::Repair(const KeyframePoses& poses, FusionResult& result) {
  Log(LogLevel::kWarning,
      "the model is broken (" + result.health.reason + "): its latest part is made again");
  std::vector<KeptMap> order;
  while (auto kept = waiting_.TakeOldest()) order.push_back(std::move(*kept));
  std::vector<KeptMap> latest;
  while (latest.size() < (order.size() + 1) / 2) {
    auto kept = recent_.TakeNewest();
    if (!kept) break;
    kept->num_attempts = 0;
    latest.insert(latest.begin(), std::move(*kept));
  }
  if (!latest.empty()) model_->TakeOut(latest.front().map_index);
  std::move(latest.begin(), latest.end(), std::back_inserter(order));
  health_.Forget();
  num_since_repair_ = 0;
  for (KeptMap& kept : order) {
    kept.num_attempts = std::min(kept.num_attempts, options_.retry.max_attempts - 1);
    result.retried.push_back(TryAgain(std::move(kept), poses, result));
    const RetriedMap& retried = result.retried.back();
    if (retried.registration.registered) {
      health_.Add(retried.registration, retried.status == FusionStatus::kFused);
    }
  }
  result.is_repaired = true;
  result.health = health_.Assess();
}

}  // namespace mono3d
