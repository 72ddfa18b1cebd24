// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <optional>

#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/pipeline.h"
#include "view/live_view.h"

namespace mono3d::tools {

// --view of a run: without it, nothing of this does anything.
class RunView {
 public:
  void AddOptions(CLI::App& app);
  // Says the URL on stdout. Throws Error where the address cannot be had.
  void Open();

  std::unique_ptr<FrameSource> Watched(std::unique_ptr<FrameSource> source);
  // To the observer of another pipeline.
  void AddTo(PipelineObserver& observer);
  // From now on the latest of these pipelines is the one in use.
  void NoteAdoption();

  // Until End, the view shows what a pipeline says, which must outlive it.
  class Watch {
   public:
    template <typename AnyPipeline>
    Watch(RunView& view, const AnyPipeline& pipeline, std::optional<std::int64_t> num_frames)
        : live_(view.live_.get()) {
      if (live_ == nullptr) return;
      live_->Begin([&pipeline](std::uint64_t since) { return pipeline.Snapshot(since); },
                   num_frames);
    }
    ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    // Throws what the pipeline has thrown where the view was the first to hear of it.
    void End();

   private:
    LiveView* live_;  // null without --view
  };

 private:
  bool is_asked_for_ = false;
  ViewArguments arguments_;
  std::unique_ptr<LiveView> live_;
};

}  // namespace mono3d::tools
