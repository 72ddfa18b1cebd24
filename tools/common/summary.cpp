// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/summary.h"

#include <algorithm>
#include <cstdio>
#include <iomanip>
#include <map>
#include <sstream>
#include <system_error>
#include <vector>

#include "common/advice.h"
#include "mono3d/core/statistics.h"
#include "mono3d/core/timing.h"

namespace mono3d::tools {
namespace {

std::string MostFrequent(const std::map<std::string, std::int64_t>& reasons) {
  std::string most;
  std::int64_t count = 0;
  for (const auto& [reason, times] : reasons) {
    if (times > count) most = reason;
    count = std::max(count, times);
  }
  return most;
}

std::string WithAdvice(const std::string& reason) {
  const std::string advice = ToText(AdviceOf(reason));
  return advice.empty() ? reason : reason + " (" + advice + ")";
}

}  // namespace

void PrintSummary(const Reconstruction& result, const RunRecord& record,
                  const std::filesystem::path& model_path) {
  const PipelineCounts& counts = result.counts;
  std::size_t num_tracked = 0;
  for (const MapReconstruction& map : result.maps) num_tracked += map.trajectory.size();
  std::printf("frames %lld  tracked %zu  keyframes %lld  bundles %lld  depth maps fused %lld\n",
              static_cast<long long>(counts.num_frames), num_tracked,
              static_cast<long long>(counts.num_keyframes),
              static_cast<long long>(counts.num_bundles), static_cast<long long>(counts.num_fused));
  if (result.live) {
    std::printf(
        "live %.1f fps  latency %.0f ms (5 %% above %.0f, largest %.0f)  frames dropped %lld  "
        "bundles dropped %lld\n",
        result.live->frames_per_s, result.live->mean_latency_ms, result.live->p95_latency_ms,
        result.live->max_latency_ms, static_cast<long long>(result.live->num_dropped_frames),
        static_cast<long long>(counts.num_dropped_bundles));
    if (!counts.reduced_depth_maps.empty()) {
      std::printf("depth maps with less work, to keep up:");
      const char* separator = "  ";
      for (const auto& [effort, number] : counts.reduced_depth_maps) {
        std::printf("%s%lld %s", separator, static_cast<long long>(number), effort.c_str());
        separator = ", ";
      }
      std::printf("\n");
    }
  }
  if (record.num_passed_over_images) {
    std::printf("images taken %lld, left out with next to no motion %lld (--stride auto)\n",
                static_cast<long long>(counts.num_frames),
                static_cast<long long>(*record.num_passed_over_images));
  }
  if (record.num_skipped_images > 0) {
    std::printf("unreadable images skipped %lld\n",
                static_cast<long long>(record.num_skipped_images));
  }
  if (counts.num_keyframes_without_image > 0) {
    std::printf("keyframes left out, images no longer kept %lld\n",
                static_cast<long long>(counts.num_keyframes_without_image));
  }
  const bool are_placed_together = record.are_photos || record.is_sparse_video;
  const char* images = record.are_photos ? "photographs" : "images";
  for (const auto& [reason, times] : counts.untracked_frames) {
    if (!are_placed_together) break;
    std::printf("%s without a pose %lld: %s\n", images, static_cast<long long>(times),
                reason.c_str());
  }
  constexpr double kFewTracked = 0.9;
  if (!are_placed_together && !counts.untracked_frames.empty() &&
      static_cast<double>(num_tracked) < kFewTracked * static_cast<double>(counts.num_frames)) {
    std::printf("images without a pose %lld, most frequent reason: %s\n",
                static_cast<long long>(counts.num_frames) - static_cast<long long>(num_tracked),
                WithAdvice(MostFrequent(counts.untracked_frames)).c_str());
  }
  if (result.maps.size() > 1 && are_placed_together) {
    std::printf("the %s make %zu maps that have nothing in common, the largest one is the model\n",
                images, result.maps.size());
  } else if (result.maps.size() > 1) {
    std::printf("%s: %zu maps, the longest one is the model\n",
                WasTrackLost(counts) ? "tracking was lost and started again"
                                     : "the scale did not come through a turn on the spot",
                result.maps.size());
  }
  std::printf("time %.1f s (processor %.1f s), peak memory %lld MB\n", record.wall_s, record.cpu_s,
              static_cast<long long>(PeakMemoryBytes() / 1'000'000));
  if (!result.maps.empty() && result.maps[0].health.state != HealthState::kGood) {
    const ModelHealth& health = result.maps[0].health;
    std::printf("the model is %s: %s\n", ToString(health.state), health.reason.c_str());
    std::printf("likely cause: %s\n", ToText(AdviceOfModel(result, record)).c_str());
  }
  for (const std::string& why : {WhyUncertain(result), WhyNotConfirmed(result)}) {
    if (!why.empty()) std::printf("%s\n", why.c_str());
  }
  if (!result.maps.empty() && !result.maps[0].model.empty()) {
    std::printf("model %s  surfels %zu%s\n", model_path.c_str(), result.maps[0].model.size(),
                record.end == RunEnd::kStopped ? "  (stopped before the end of the input)" : "");
  }
  const std::filesystem::path report = model_path.parent_path() / "report.html";
  std::error_code ignored;
  if (std::filesystem::exists(report, ignored)) std::printf("report %s\n", report.c_str());
}

std::string WhyUncertain(const Reconstruction& result) {
  if (result.maps.empty() || result.maps[0].model.confidences.empty()) return {};
  const std::vector<float>& confidences = result.maps[0].model.confidences;
  const double median = UpperMedian(confidences);
  // Of a depth map, where the depth is known to half a percent.
  if (median >= SurfelExportOptions().min_confidence) return {};
  std::ostringstream text;
  text << std::setprecision(2)
       << "the model is uncertain: half of its surfels have a confidence of " << median
       << " and less (depth known to half a percent has 0.17)";
  if (!result.counts.selector_findings.empty())
    text << ", from " << result.counts.selector_findings;
  return text.str();
}

std::string WhyNotConfirmed(const Reconstruction& result) {
  if (result.maps.empty() || result.maps[0].model.empty()) return {};
  if (result.maps[0].health.num_registrations > 0) return {};
  return result.counts.num_fused > 1
             ? "the depth maps of the model do not overlap: none confirms another"
             : "the model is of one depth map: no other one confirms it";
}

std::string WhyNoModel(const Reconstruction& result) {
  if (result.maps.empty()) {
    return "no model: tracking never started; most frequent reason: " +
           WithAdvice(MostFrequent(result.counts.untracked_frames));
  }
  if (!result.maps[0].model.empty()) return {};
  const std::string& found = result.counts.selector_findings;
  if (result.counts.num_bundles == 0) {
    return "no model: no depth" + (found.empty() ? "" : ", " + found);
  }
  if (result.counts.num_fused > 0) {
    return "no model: no surfel of the depth maps that were fused can be exported" +
           (found.empty() ? "" : " (" + found + ")");
  }
  std::string reason = MostFrequent(result.counts.rejected_bundles);
  if (reason.empty()) reason = MostFrequent(result.counts.rejected_depth_maps);
  return "no model: no depth map was fused; most frequent reason: " + WithAdvice(reason) +
         (found.empty() ? "" : " (" + found + ")");
}

}  // namespace mono3d::tools
