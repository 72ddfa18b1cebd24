// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "mono3d/fusion/confidence_histogram.h"
#include "mono3d/image/depth_map.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/snapshot.h"
#include "view/view_server.h"
#include "view/view_store.h"

namespace mono3d::tools {

// A run as it goes on, for viewers. What the run hands over is copied small and at once; all else
// is done in a thread of its own, at most twice a second and in at most a fifth of the time. While
// nobody watches, the run is not asked for its surfels.
class LiveView {
 public:
  using TakeSnapshot = std::function<PipelineSnapshot(std::uint64_t since_version)>;

  // Throws Error where the address cannot be had.
  explicit LiveView(const ViewArguments& arguments);
  ~LiveView();

  const std::string& url() const { return server_.url(); }

  // The same frames, of which the view sees some. The view must outlive it.
  std::unique_ptr<FrameSource> Watched(std::unique_ptr<FrameSource> source);
  void NoteFrame(const cv::Mat& bgr);
  // Another pipeline makes depth maps, of keyframes with numbers of their own; the number returned
  // is to be told with them. The first one is in use, until the latest takes its place.
  int NotePipeline() { return num_pipelines_++; }
  void UseLatestPipeline() { pipeline_in_use_ = num_pipelines_ - 1; }
  void NoteDepthMap(const DepthMap& map, int pipeline = 0);

  // From now on, until End, `take_snapshot` says what there is.
  void Begin(TakeSnapshot take_snapshot, std::optional<std::int64_t> num_frames);
  // What there is last remains in view. Throws what `take_snapshot` has thrown, for the run may not
  // hear of it again.
  void End();

  const ViewStore& store() const { return store_; }

 private:
  struct KeyframePicture {
    std::int64_t keyframe = 0;
    cv::Mat bgr, depth;  // small
  };

  void Work();
  void Update(bool is_last);
  void CountConfidences(const SurfelChanges& changes);
  bool ChooseLimit();
  void UpdateModel(const PipelineSnapshot& snapshot);
  void UpdateWay(const PipelineSnapshot& snapshot);
  void UpdateUp(std::span<const Pose> T_world_cam);
  void UpdateStatus(const PipelineSnapshot& snapshot, const char* phase);
  void UpdatePictures();

  ViewStore store_;
  std::atomic<int> num_pipelines_ = 0, pipeline_in_use_ = 0;
  std::uint64_t version_ = 0;                                     // that was taken last
  std::map<std::int64_t, std::vector<Eigen::Vector3f>> normals_;  // of each block, in its frame
  // With which up was found.
  std::size_t num_keyframes_of_up_ = 0, num_blocks_of_up_ = 0;
  std::map<std::int64_t, Similarity> S_world_block_;
  std::map<std::int64_t, ConfidenceHistogram> confidences_;       // of each block
  double min_confidence_ = SurfelExportOptions().min_confidence;  // of what is shown
  TakeSnapshot take_snapshot_;
  std::optional<std::int64_t> num_frames_;

  std::mutex pictures_mutex_;
  double image_taken_ms_ = -1e9;
  cv::Mat image_;  // small; empty: none since the last one
  std::deque<KeyframePicture> keyframe_pictures_;

  std::mutex mutex_;
  std::condition_variable ended_;
  bool must_end_ = false;
  std::exception_ptr error_;
  std::thread thread_;

  ViewServer server_;  // ends first
};

}  // namespace mono3d::tools
