// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/ablation.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <utility>

#include "bench/true_bundles.h"
#include "evaluate/files.h"
#include "mono3d/core/error.h"
#include "mono3d/core/timing.h"
#include "mono3d/evaluation/confidence_calibration.h"
#include "mono3d/evaluation/depth_error.h"
#include "mono3d/evaluation/normal_error.h"

namespace mono3d::tools {
namespace {

// A bundle with what its estimates are compared with.
struct DepthTruth {
  TrueBundle bundle;
  cv::Mat normals;
  cv::Mat slanted_depth;  // the true depth where the surface is slanted
};

std::vector<DepthTruth> ReadDepthTruth(const std::string& folder, const AblationOptions& options) {
  std::vector<DepthTruth> truths;
  for (TrueBundle& bundle : ReadTrueBundles(folder, options.num_bundles, options.step)) {
    DepthTruth truth;
    const CameraModel& camera = bundle.bundle.reference().frame.camera;
    truth.normals = NormalsFromDepth(bundle.true_depth, camera);
    truth.slanted_depth = bundle.true_depth.clone();
    truth.slanted_depth.setTo(0, SlantedSurfaces(truth.normals, camera, kSlantedFrom_deg) == 0);
    truth.bundle = std::move(bundle);
    truths.push_back(std::move(truth));
  }
  return truths;
}

AblationFigures CompareWithTruth(const DepthMap& map, const DepthTruth& truth) {
  const cv::Mat& depth = truth.bundle.true_depth;
  AblationFigures figures;
  const double scale = MedianDepthScale(map.depth, depth).value_or(1);
  const DepthError error = CompareDepth(map.depth, depth, scale);
  const ConfidenceCalibration confidence =
      CalibrateConfidence(RelativeDepthErrorImage(map.depth, depth, scale), map.confidence);
  figures.num_maps = 1;
  figures.l1_rel = error.l1_rel;
  figures.delta_101 = error.delta_101;
  figures.delta_105 = error.delta_105;
  figures.density = error.density;
  figures.normals_median_deg = CompareNormals(map.normal, truth.normals).angle_deg.median;
  figures.slanted_l1_rel = CompareDepth(map.depth, truth.slanted_depth, scale).l1_rel;
  figures.removed = confidence.error_removed_by_worst_tenth;
  figures.removed_oracle = confidence.error_removed_by_worst_tenth_oracle;
  return figures;
}

ImageBundle Middle(const ImageBundle& bundle, std::size_t num_images) {
  const auto first = static_cast<std::ptrdiff_t>((bundle.keyframes.size() - num_images) / 2);
  const auto end = first + static_cast<std::ptrdiff_t>(num_images);
  const auto keyframes = bundle.keyframes.begin();
  const auto poses = bundle.T_ref_cam.begin();
  return {{keyframes + first, keyframes + end}, {poses + first, poses + end}};
}

// Over the bundles of one sequence.
AblationFigures FiguresOf(const AblationVariant& variant, const std::shared_ptr<Device>& device,
                          const std::vector<DepthTruth>& truths) {
  const auto estimator = CreateDepthEstimator(device, variant.depth);
  (void)estimator->Estimate(Middle(truths.front().bundle.bundle, variant.num_images));
  std::vector<AblationFigures> figures;
  double least_cpu_ms = 0;
  for (const DepthTruth& truth : truths) {
    const ImageBundle bundle = Middle(truth.bundle.bundle, variant.num_images);
    const double start_ms = ProcessCpuMs();
    const DepthResult result = estimator->Estimate(bundle);
    const double cpu_ms = ProcessCpuMs() - start_ms;
    figures.push_back(result.status == DepthStatus::kEstimated ? CompareWithTruth(result.map, truth)
                                                               : AblationFigures{});
    figures.back().num_bundles = 1;
    least_cpu_ms = least_cpu_ms > 0 ? std::min(least_cpu_ms, cpu_ms) : cpu_ms;
  }
  AblationFigures mean = MeanFigures(figures);
  mean.cpu_ms = least_cpu_ms;
  return mean;
}

std::vector<AblationVariant> ChosenDepthVariants(const AblationOptions& options) {
  std::vector<AblationVariant> all = AblationVariants(options.depth);
  if (options.only.empty()) return all;
  std::vector<AblationVariant> chosen = {all.front()};
  for (const std::string& name : options.only) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const auto& v) { return v.name == name; });
    if (found == all.end()) {
      std::string names;
      for (const AblationVariant& variant : all)
        names += (names.empty() ? "" : ", ") + variant.name;
      throw UsageError(ErrorParts{"no such variant", "--only", names, name});
    }
    if (found != all.begin()) chosen.push_back(*found);
  }
  return chosen;
}

}  // namespace

std::vector<AblationVariant> AblationVariants(const DepthEstimatorOptions& depth) {
  std::vector<AblationVariant> variants;
  const auto add = [&](const char* name,
                       const std::function<void(DepthEstimatorOptions&)>& change) {
    variants.push_back({name, depth});
    change(variants.back().depth);
  };
  add("default", [](auto&) {});
  add("2 matching images, not 4", [](auto&) {});
  variants.back().num_images = 3;
  add("better side only", [](auto& o) { o.plane_sweep.side_tolerance = 0; });
  add("mean of the sides", [](auto& o) { o.plane_sweep.side_tolerance = 64; });
  add("one level", [](auto& o) { o.pyramid.num_levels = 1; });
  add("SGM, not SGM^sn", [](auto& o) { o.sgm.follow_normals = false; });
  add("fixed P2", [](auto& o) { o.sgm.min_p2 = o.sgm.p2; });
  add("8 finest paths", [](auto& o) { o.sgm.finest_paths = 8; });
  add("no sub-plane", [](auto& o) { o.winner_takes_all.sub_plane = false; });
  add("no median", [](auto& o) { o.median.min_support = 0; });
  add("no refinement", [](auto& o) { o.refinement.iterations = 0; });
  add("no refinement, SGM", [](auto& o) {
    o.refinement.iterations = 0;
    o.sgm.follow_normals = false;
  });
  add("no refinement, no sub-plane", [](auto& o) {
    o.refinement.iterations = 0;
    o.winner_takes_all.sub_plane = false;
  });
  add("no DoG", [](auto& o) { o.dog.min_response = 0; });
  return variants;
}

AblationFigures MeanFigures(const std::vector<AblationFigures>& figures) {
  constexpr double AblationFigures::*kMeans[] = {
      &AblationFigures::l1_rel,         &AblationFigures::delta_101,
      &AblationFigures::delta_105,      &AblationFigures::normals_median_deg,
      &AblationFigures::slanted_l1_rel, &AblationFigures::removed,
      &AblationFigures::removed_oracle};
  AblationFigures mean;
  double num_with_maps = 0;
  for (const AblationFigures& one : figures) {
    mean.num_maps += one.num_maps;
    mean.num_bundles += one.num_bundles;
    mean.density += one.density;
    mean.cpu_ms += one.cpu_ms;
    if (one.num_maps == 0) continue;
    ++num_with_maps;
    for (const auto figure : kMeans) mean.*figure += one.*figure;
  }
  const auto count = static_cast<double>(std::max<std::size_t>(figures.size(), 1));
  mean.density /= count;
  mean.cpu_ms /= count;
  for (const auto figure : kMeans) mean.*figure /= std::max(num_with_maps, 1.0);
  return mean;
}

AblationResult RunAblation(const AblationOptions& options, const DeviceOptions& device_options) {
  options.depth.Validate();
  const std::vector<AblationVariant> variants = ChosenDepthVariants(options);
  const std::shared_ptr<Device> device = OpenDevice(device_options);
  AblationResult result;
  result.device = Info(*device).name;
  for (const AblationVariant& variant : variants) result.rows.push_back({variant.name, {}, {}});
  for (const std::string& folder : options.folders) {
    result.sequences.push_back(NameOfFolder(folder));
    const std::vector<DepthTruth> truths = ReadDepthTruth(folder, options);
    for (std::size_t i = 0; i < variants.size(); ++i) {
      result.rows[i].sequences.push_back(FiguresOf(variants[i], device, truths));
    }
  }
  for (AblationRow& row : result.rows) row.mean = MeanFigures(row.sequences);
  return result;
}

}  // namespace mono3d::tools
