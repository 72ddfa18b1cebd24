// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Models that are made by threads of their own while the next frames are tracked.

#include <gmock/gmock.h>

#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/pipeline/pipeline.h"
#include "pipeline/gate.h"
#include "pipeline/live_stages.h"
#include "pipeline/trailing_model_worker.h"

namespace mono3d {
namespace {

using testing::ElementsAre;

// Notes after how many frames it is told of which depth map.
class NotingSelector final : public KeyframeSelector {
 public:
  using Told = std::vector<std::pair<std::int64_t, std::int64_t>>;

  explicit NotingSelector(const std::int64_t* num_tracked, Told* told)
      : num_tracked_(num_tracked), told_(told) {}
  std::optional<ImageBundle> Add(const Keyframe& keyframe, const KeyframePoses&) override {
    return keyframe.id % 2 == 0 ? std::optional(ImageBundle{{keyframe}, {}}) : std::nullopt;
  }
  void ReportDepthQuality(const DepthQuality& quality) override {
    told_->emplace_back(quality.reference_id, *num_tracked_);
  }

 private:
  const std::int64_t* num_tracked_;
  Told* told_;
};

PipelineStages StagesOf(const LiveScript& script) {
  PipelineStages stages;
  stages.tracker = std::make_unique<KeepingTracker>(&script);
  stages.keyframe_selector = std::make_unique<SingleSelector>();
  stages.depth_estimator = std::make_unique<ScriptedEstimator>(&script);
  stages.create_surfel_map = [] { return std::make_unique<CountingSurfelMap>(); };
  return stages;
}

// The bundle of frame 0 is complete with frame 1.
TEST(TrailingModels, TheNextFramesAreTrackedMeanwhile) {
  Gate gate;
  LiveScript script;
  script.on_estimate = [&](const ImageBundle&) { gate.Pass(); };
  Pipeline pipeline(StagesOf(script));
  pipeline.Process(NumberedFrame(0));
  pipeline.Process(NumberedFrame(1));
  gate.WaitForArrival();
  pipeline.Process(NumberedFrame(2));
  // Frame 3 completes the third bundle, which waits for the first one.
  auto next = std::async(std::launch::async, [&] { pipeline.Process(NumberedFrame(3)); });
  EXPECT_EQ(next.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  gate.Open();
  next.get();
  EXPECT_EQ(pipeline.Finish().maps.at(0).model.size(), 4U);
}

TEST(TrailingModels, EachProcessEndsWithItsModelWhereThatIsAskedFor) {
  std::vector<std::int64_t> estimated;
  LiveScript script;
  script.on_estimate = [&](const ImageBundle& bundle) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    estimated.push_back(bundle.reference().id);
  };
  PipelineOptions options;
  options.models_trail = false;
  Pipeline pipeline(StagesOf(script), {}, options);
  for (std::int64_t i = 0; i < 3; ++i) {
    pipeline.Process(NumberedFrame(i));
    EXPECT_EQ(static_cast<std::int64_t>(estimated.size()), i);
  }
}

// The depth map of one bundle is estimated while that of the one before is fused.
TEST(TrailingModels, TheNextDepthMapIsEstimatedWhileOneIsFused) {
  Gate gate;
  std::promise<void> second;
  LiveScript script;
  script.on_estimate = [&](const ImageBundle& bundle) {
    if (bundle.reference().id == 1) second.set_value();
  };
  PipelineObserver observer;
  observer.on_depth_map = [&](const DepthMap& map, const FusionResult&) {
    if (map.frame_index == 0) gate.Pass();
  };
  Pipeline pipeline(StagesOf(script), observer);
  for (std::int64_t i = 0; i < 3; ++i) pipeline.Process(NumberedFrame(i));
  gate.WaitForArrival();
  second.get_future().wait();  // forever, if it waited for the first one to be fused
  gate.Open();
  EXPECT_EQ(pipeline.Finish().maps.at(0).model.size(), 3U);
}

// What the depth maps tell the stages before comes at the same frame, fast or slow.
TEST(TrailingModels, FeedbackComesAtTheSameFrameHoweverLongADepthMapTakes) {
  const auto told_by = [](int depth_ms, int frame_ms) {
    std::int64_t num_tracked = 0;
    NotingSelector::Told told;
    LiveScript script;
    script.on_track = [&](const Frame&) {
      ++num_tracked;
      std::this_thread::sleep_for(std::chrono::milliseconds(frame_ms));
    };
    script.on_estimate = [&](const ImageBundle&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(depth_ms));
    };
    PipelineStages stages = StagesOf(script);
    stages.keyframe_selector = std::make_unique<NotingSelector>(&num_tracked, &told);
    Pipeline pipeline(std::move(stages));
    for (std::int64_t i = 0; i < 9; ++i) pipeline.Process(NumberedFrame(i));
    (void)pipeline.Finish();
    return told;
  };
  const NotingSelector::Told slow_depth = told_by(20, 0);
  // The bundle of frame 4 is added with frame 5; then that of frame 0 is done, which frame 6 is
  // told of before it is tracked. The last ones come at the end.
  using Of = std::pair<std::int64_t, std::int64_t>;
  EXPECT_THAT(slow_depth, ElementsAre(Of(0, 6), Of(2, 8), Of(4, 9), Of(6, 9), Of(8, 9)));
  EXPECT_EQ(told_by(0, 5), slow_depth);
}

// A model that is its depth maps' frames, and can be saved.
class FramesMap final : public SurfelMap {
 public:
  FusionResult Integrate(const DepthMap& map, const KeyframePoses&) override {
    frames_.push_back(static_cast<char>('0' + map.frame_index));
    FusionResult result;
    result.status = FusionStatus::kFused;
    return result;
  }
  UpdateResult Update(const KeyframePoses&) override { return {}; }
  std::vector<FusedDepthMap> DepthMaps() const override { return {}; }
  PointCloud Export(const SurfelExportOptions&) const override { return {}; }
  std::int64_t num_surfels() const override { return static_cast<std::int64_t>(frames_.size()); }
  void SaveState(StateFolder& folder, const std::string& name) override {
    folder.Put(name, frames_);
  }
  void RestoreState(const StateFolder& folder, const std::string& name) override {
    frames_ = folder.Get(name);
  }

 private:
  std::string frames_;
};

class TrailingState : public TemporaryFolderTest {
 protected:
  ModelStages Stages() {
    ModelStages stages;
    stages.create_surfel_map = [] { return std::make_unique<FramesMap>(); };
    stages.on_depth_map = [this](const DepthMap& map, const FusionResult&) {
      const std::lock_guard lock(mutex_);
      fused_.push_back(map.frame_index);
    };
    return stages;
  }
  std::vector<std::int64_t> Fused() {
    const std::lock_guard lock(mutex_);
    return fused_;
  }
  static std::vector<std::int64_t> References(const ModelFeedback& feedback) {
    std::vector<std::int64_t> references;
    for (const DepthQuality& quality : feedback.qualities) {
      references.push_back(quality.reference_id);
    }
    return references;
  }

  std::mutex mutex_;
  std::vector<std::int64_t> fused_;
};

// Bundle 0 is done, 1 is being estimated, and the poses have changed since.
TEST_F(TrailingState, HasTheBundlesThatAreNotDone) {
  std::vector<KeyframePosesPtr> poses;
  for (std::uint64_t version = 1; version <= 2; ++version) {
    poses.push_back(std::make_shared<KeyframePoses>(
        version, std::vector<KeyframePose>{{0, 0, Similarity()}, {1, 0, Similarity()}}));
  }
  const auto bundle = [](std::int64_t index) {
    return ImageBundle{{Keyframe{index, NumberedFrame(index), {1}}}, {}};
  };
  StateFolder folder(folder_ / "state");
  Gate gate;
  LiveScript script;
  script.on_estimate = [&](const ImageBundle& estimated) {
    if (estimated.reference().id == 1) gate.Pass();
  };
  TrailingModelWorker worker(std::make_unique<ScriptedEstimator>(&script), Stages());
  worker.Add(bundle(0), poses[0]);
  worker.Add(bundle(1), poses[0]);
  worker.Update(poses[1]);
  gate.WaitForArrival();
  while (Fused().empty()) std::this_thread::yield();
  int num_rests = 0;
  worker.SaveState(folder, SavedImages::kByIndex, [&] {
    ++num_rests;
    EXPECT_THAT(Fused(), ElementsAre(0));
  });
  (void)folder.Commit();
  EXPECT_EQ(num_rests, 1);
  gate.Open();
  worker.Wait();
  EXPECT_THAT(Fused(), ElementsAre(0, 1)) << "the run goes on";
  EXPECT_THAT(References(worker.TakeFeedback()), ElementsAre(0, 1));

  fused_.clear();
  EXPECT_THAT(TrailingModelWorker::FramesOfState(folder), ElementsAre(1));
  double value = 0;
  script.on_estimate = [&](const ImageBundle& estimated) {
    value = estimated.reference().frame.bgr.at<cv::Vec3b>(0, 0)[0];
  };
  TrailingModelWorker restored(std::make_unique<ScriptedEstimator>(&script), Stages());
  restored.RestoreState(folder, poses[1],
                        [](std::int64_t index) { return NumberedFrame(index).bgr; });
  restored.Wait();
  EXPECT_THAT(Fused(), ElementsAre(1));
  EXPECT_EQ(value, 1) << "the image of its frame";
  EXPECT_THAT(References(restored.TakeFeedback()), ElementsAre(0, 1));
  EXPECT_EQ(restored.Progress().num_surfels, 2);
  EXPECT_EQ(restored.End().poses(), poses[1]);
}

}  // namespace
}  // namespace mono3d
