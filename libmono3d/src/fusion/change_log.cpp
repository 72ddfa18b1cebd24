// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/change_log.h"

#include <algorithm>
#include <span>
#include <utility>

#include "fusion/export.h"
#include "fusion/state_archive.h"

namespace mono3d {
namespace {

std::shared_ptr<const PointCloud> DownloadChunk(const SurfelModel& model, std::uint32_t anchor,
                                                std::span<const std::uint32_t> frames) {
  const std::vector<Similarity> in_own_frame(anchor + 1);
  const SurfelExportOptions all{.min_observations = 1, .min_confidence = 0};
  return std::make_shared<const PointCloud>(ToPointCloud(
      model.surfels.Download(anchor), model.inferred.Download(anchor), in_own_frame, frames, all));
}

}  // namespace

void ChangeLog::Changed(std::span<const std::uint32_t> anchors) {
  if (anchors.empty()) return;
  ++version_;
  for (const std::uint32_t anchor : anchors) {
    if (anchor >= chunks_.size()) chunks_.resize(anchor + 1);
    chunks_[anchor].version = version_;
  }
}

void ChangeLog::AllChanged(std::uint32_t num_anchors) {
  ++version_;
  chunks_.resize(num_anchors);
  for (Chunk& chunk : chunks_) chunk.version = version_;
}

SurfelChanges ChangeLog::Since(std::uint64_t version, const SurfelModel& model) {
  SurfelChanges changes;
  changes.version = version_;
  chunks_.resize(model.anchors.size());
  const std::vector<std::uint32_t> frames = model.anchors.Frames();
  for (std::uint32_t i = 0; i < model.anchors.size(); ++i) {
    const Anchor& anchor = model.anchors.anchor(i);
    changes.anchors.push_back({i, anchor.keyframe_id, anchor.frame_index,
                               model.anchors.S_world_surfels()[i], anchor.timestamp_s});
    Chunk& chunk = chunks_[i];
    if (chunk.version <= version) continue;
    std::shared_ptr<const PointCloud> surfels;
    if (chunk.downloaded_version == chunk.version) surfels = chunk.surfels.lock();
    if (surfels == nullptr) {
      surfels = DownloadChunk(model, i, frames);
      chunk.surfels = surfels;
      chunk.downloaded_version = chunk.version;
    }
    changes.changed.push_back({i, std::move(surfels)});
  }
  return changes;
}

// What was downloaded before is downloaded again when it is asked for.
template <typename Archive>
void ChangeLog::Exchange(Archive& archive) {
  archive.Number(version_);
  archive.List(chunks_, [&](Chunk& chunk) { archive.Number(chunk.version); });
  RequireSound(archive, std::ranges::all_of(chunks_, [&](const Chunk& chunk) {
                 return chunk.version <= version_;
               }));
}

template void ChangeLog::Exchange(ByteWriter& archive);
template void ChangeLog::Exchange(ByteReader& archive);

}  // namespace mono3d
