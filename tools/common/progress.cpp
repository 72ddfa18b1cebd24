// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/progress.h"

#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "mono3d/core/timing.h"

namespace mono3d::tools {
namespace {

constexpr double kTerminalInterval_ms = 100;
constexpr double kPlainInterval_ms = 10'000;

}  // namespace

std::string FormatProgress(const PipelineProgress& progress, std::optional<std::int64_t> num_frames,
                           double elapsed_s) {
  const PipelineCounts& counts = progress.counts;
  const double fps = elapsed_s > 0 ? static_cast<double>(counts.num_frames) / elapsed_s : 0;
  std::string text = "frame " + std::to_string(counts.num_frames);
  if (num_frames) text += "/" + std::to_string(*num_frames);
  std::array<char, 160> rest{};
  std::snprintf(rest.data(), rest.size(),
                "  %.1f fps  %s  keyframes %lld  maps %lld  surfels %lldk", fps,
                ToString(progress.tracking.status), static_cast<long long>(counts.num_keyframes),
                static_cast<long long>(counts.num_fused),
                static_cast<long long>(progress.num_surfels / 1000));
  text += rest.data();
  if (progress.health.state != HealthState::kGood) {
    text += std::string("  model ") + ToString(progress.health.state) + " (" +
            progress.health.reason + ")";
  }
  if (progress.place) {
    std::array<char, 64> scale{};
    std::snprintf(scale.data(), scale.size(), "  on the earth, scale +- %.2g %%",
                  100 * progress.place->georeference.scale_sigma);
    text += scale.data();
  }
  if (num_frames && fps > 0) {
    const double eta_s = static_cast<double>(*num_frames - counts.num_frames) / fps;
    text += "  ETA " + std::to_string(std::lround(std::ceil(eta_s))) + " s";
  }
  return text;
}

ProgressLine::ProgressLine(std::optional<std::int64_t> num_frames)
    : num_frames_(num_frames),
      is_terminal_(isatty(STDERR_FILENO) != 0),
      start_ms_(WallClockMs()),
      last_ms_(start_ms_) {}

ProgressLine::~ProgressLine() {
  if (is_terminal_) std::fputs("\n", stderr);
}

void ProgressLine::Show(const PipelineProgress& progress) {
  const double now_ms = WallClockMs();
  if (now_ms - last_ms_ < (is_terminal_ ? kTerminalInterval_ms : kPlainInterval_ms)) return;
  last_ms_ = now_ms;
  const std::string text = FormatProgress(progress, num_frames_, 1e-3 * (now_ms - start_ms_));
  // "\033[K" clears what a longer line left behind.
  std::fprintf(stderr, is_terminal_ ? "\r%s\033[K" : "%s\n", text.c_str());
  std::fflush(stderr);
}

}  // namespace mono3d::tools
