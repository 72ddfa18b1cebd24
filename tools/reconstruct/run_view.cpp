// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/run_view.h"

#include <cstdio>
#include <utility>

namespace mono3d::tools {

void RunView::AddOptions(CLI::App& app) {
  app.add_flag("--view", is_asked_for_,
               "show the model as it grows on a page for a browser, and say where");
  AddViewOptions(app, arguments_);
}

void RunView::Open() {
  if (!is_asked_for_) return;
  live_.reset();  // of an earlier attempt, at the same address
  live_ = std::make_unique<LiveView>(arguments_);
  std::printf("view: %s\n", live_->url().c_str());
  std::fflush(stdout);
}

std::unique_ptr<FrameSource> RunView::Watched(std::unique_ptr<FrameSource> source) {
  return live_ ? live_->Watched(std::move(source)) : std::move(source);
}

void RunView::AddTo(PipelineObserver& observer) {
  if (!live_) return;
  observer.on_depth_map = [before = std::move(observer.on_depth_map), live = live_.get(),
                           pipeline = live_->NotePipeline()](const DepthMap& map,
                                                             const FusionResult& result) {
    if (before) before(map, result);
    live->NoteDepthMap(map, pipeline);
  };
}

void RunView::NoteAdoption() {
  if (live_) live_->UseLatestPipeline();
}

RunView::Watch::~Watch() {
  try {
    End();
  } catch (...) {  // on the way out of another error
  }
}

void RunView::Watch::End() {
  if (live_ != nullptr) std::exchange(live_, nullptr)->End();
}

}  // namespace mono3d::tools
