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

std::string FormatProgress(const PhotoMapperProgress& progress, std::int64_t done_in_time,
                           double elapsed_s) {
  using Step = PhotoMapperProgress::Step;
  const std::string count = std::to_string(progress.done) +
                            (progress.total > 0 ? "/" + std::to_string(progress.total) : "");
  std::string text = progress.step == Step::kFeatures   ? "features of " + count + " images"
                     : progress.step == Step::kMatching ? "matched " + count + " pairs of images"
                                                        : "placed " + count + " images";
  // How long placing takes does not go with the number of images.
  if (progress.step != Step::kPlacing && progress.total > 0 && done_in_time > 0) {
    const double eta_s = elapsed_s * static_cast<double>(progress.total - progress.done) /
                         static_cast<double>(done_in_time);
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
  if (is_terminal_ && has_shown_) std::fputs("\n", stderr);
}

bool ProgressLine::IsDue() const {
  return WallClockMs() - last_ms_ >= (is_terminal_ ? kTerminalInterval_ms : kPlainInterval_ms);
}

void ProgressLine::Print(const std::string& text) {
  last_ms_ = WallClockMs();
  has_shown_ = true;
  // "\033[K" clears what a longer line left behind.
  std::fprintf(stderr, is_terminal_ ? "\r%s\033[K" : "%s\n", text.c_str());
  std::fflush(stderr);
}

void ProgressLine::Show(const PipelineProgress& progress) {
  if (!IsDue()) return;
  Print(FormatProgress(progress, num_frames_, 1e-3 * (WallClockMs() - start_ms_)));
}

void ProgressLine::Show(const PhotoMapperProgress& progress, const std::string& doing) {
  if (progress.step != step_.step || progress.total != step_.total || progress.done < step_.done ||
      step_start_ms_ == 0) {
    step_ = progress;
    step_start_ms_ = WallClockMs();
  }
  if (!IsDue()) return;
  Print((doing.empty() ? "" : doing + ": ") +
        FormatProgress(progress, progress.done - step_.done,
                       1e-3 * (WallClockMs() - step_start_ms_)));
}

}  // namespace mono3d::tools
