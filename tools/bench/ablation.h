// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/sequence_result.h"
#include "mono3d/depth/depth_estimator.h"
#include "report/table.h"

namespace mono3d::tools {

// Ablation of the depth stage: bundles of sequences with true depth and true poses are estimated
// with the default options, and again with one part after the other left out or exchanged.
struct AblationOptions {
  std::vector<std::string> folders;  // images/, camera.yaml, groundtruth.txt, depth/
  int num_bundles = 3;               // of each sequence, spread over it
  int step = 0;  // images from one of a bundle to the next; 0: bundles of the selector
  std::vector<std::string> only;  // names of variants beside the first; none: all
  DepthEstimatorOptions depth;    // of the first variant
};

struct AblationVariant {
  std::string name;
  DepthEstimatorOptions depth;
  std::size_t num_images = kBundleSize;  // odd; those in the middle of the bundle
};

// The first is `depth` itself.
std::vector<AblationVariant> AblationVariants(const DepthEstimatorOptions& depth);

// Surfaces are slanted from this angle between normal and ray on.
inline constexpr double kSlantedFrom_deg = 40;

// Errors after median scaling of each map, as in the paper's Table 3.
struct AblationFigures {
  double num_maps = 0;  // that were estimated
  double num_bundles = 0;
  double l1_rel = 0;
  double delta_101 = 0;
  double delta_105 = 0;
  double density = 0;             // share of the true pixels; rejected bundles count as 0
  double normals_median_deg = 0;  // to the truth's own normals
  double slanted_l1_rel = 0;      // over the slanted surfaces alone
  double removed = 0;  // share of l1_rel that goes with the least confident tenth of the pixels
  double removed_oracle = 0;  // with the worst tenth
  double cpu_ms = 0;  // of the process, the least over the maps: the first, which makes pipelines,
                      // is estimated twice
};

// The mean of each figure but the counts, which are sums; over those with maps.
AblationFigures MeanFigures(const std::vector<AblationFigures>& figures);

struct AblationRow {
  std::string name;
  std::vector<AblationFigures> sequences;  // in the order of the folders, over their bundles
  AblationFigures mean;                    // over the sequences
};

struct AblationResult {
  std::string device;
  std::vector<std::string> sequences;  // names of the folders
  std::vector<AblationRow> rows;
};

// Throws Error when a sequence has no true depth, too few poses or no bundle, UsageError on a
// variant that there is not.
AblationResult RunAblation(const AblationOptions& options, const DeviceOptions& device);

// The means over the sequences; then L1-rel by sequence.
std::vector<Table> ToTables(const AblationResult& result);
Json ToJson(const AblationResult& result);

}  // namespace mono3d::tools
