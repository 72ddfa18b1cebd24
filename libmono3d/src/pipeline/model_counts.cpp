// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/model_counts.h"

namespace mono3d {

void AddModelCounts(const PipelineCounts& model, PipelineCounts& counts) {
  counts.num_dropped_bundles += model.num_dropped_bundles;
  counts.num_depth_maps += model.num_depth_maps;
  counts.num_fused += model.num_fused;
  counts.num_fused_late += model.num_fused_late;
  counts.num_repairs += model.num_repairs;
  counts.num_submaps_started += model.num_submaps_started;
  counts.num_submaps_joined += model.num_submaps_joined;
  counts.num_models_joined += model.num_models_joined;
  counts.num_corrections += model.num_corrections;
  counts.num_constraints += model.num_constraints;
  for (const auto& [reason, times] : model.rejected_bundles) {
    counts.rejected_bundles[reason] += times;
  }
  for (const auto& [reason, times] : model.rejected_depth_maps) {
    counts.rejected_depth_maps[reason] += times;
  }
}

std::string ReasonClass(const std::string& reason) {
  std::string result;
  bool in_number = false;
  for (const char c : reason) {
    const bool is_digit = c >= '0' && c <= '9';
    if (is_digit || (in_number && c == '.')) {
      if (!in_number) result += '#';
      in_number = true;
    } else {
      in_number = false;
      result += c;
    }
  }
  return result.empty() ? "no reason given" : result;
}

}  // namespace mono3d
