// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "fusion/fusion_context.h"
#include "mono3d/fusion/surfel_changes.h"

namespace mono3d {

// Keeps count of which anchors' surfels have changed, and hands them out.
class ChangeLog {
 public:
  // The surfels of these anchors have changed; new anchors are among them.
  void Changed(std::span<const std::uint32_t> anchors);
  // Those of all of `num_anchors` have; there are no others any more.
  void AllChanged(std::uint32_t num_anchors);

  // When the surfels of an anchor have changed last; the larger, the later.
  std::uint64_t VersionOf(std::uint32_t anchor) const {
    return anchor < chunks_.size() ? chunks_[anchor].version : version_;
  }
  std::uint64_t version() const { return version_; }
  // For a saved state; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);

  // Downloads what has changed, once for all that ask while one of them keeps it; what is not on
  // the device is read where it is.
  SurfelChanges Since(std::uint64_t version, const SurfelModel& model);

 private:
  struct Chunk {
    std::uint64_t version = 0;  // of its surfels
    std::uint64_t downloaded_version = 0;
    std::weak_ptr<const PointCloud> surfels;  // as long as somebody has them
  };

  std::uint64_t version_ = 0;
  std::vector<Chunk> chunks_;  // per anchor
};

}  // namespace mono3d
