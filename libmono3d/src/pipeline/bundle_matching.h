// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <vector>

#include "mono3d/depth/depth_estimator.h"
#include "mono3d/fusion/model_health.h"

namespace mono3d {

// Which of the latest bundles of a map matched. Where poses are wrong most do not, and what matches
// by chance may still fit a model that is made of nothing else: registration alone calls it good.
class BundleMatching {
 public:
  // A bundle that cannot match for another reason, such as no texture, says nothing.
  void Add(const DepthResult& depth);

  // `health`, or less good where more than half of the latest bundles did not match.
  ModelHealth Judge(ModelHealth health) const;

  // For a saved state; see run_state.h.
  template <typename Archive>
  void Exchange(Archive& archive) {
    archive.List(matched_, [&](std::uint8_t& matched) { archive.Number(matched); });
  }

 private:
  std::vector<std::uint8_t> matched_;  // 1 or 0, the newest last
};

}  // namespace mono3d
