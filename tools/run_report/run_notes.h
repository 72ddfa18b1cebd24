// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "mono3d/image/depth_map.h"
#include "mono3d/image/frame.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/pipeline.h"
#include "run_report/even_sample.h"

namespace mono3d::tools {

// What became of a frame when it came.
struct FrameNote {
  std::int64_t frame_index = 0;
  bool is_tracked = false;  // or looked at with all others, at the end
  std::string reason;       // why it has no pose, where it has none
  std::string photo = {};   // name of the file; empty: of a frame of a video
};

// A depth map, small.
struct DepthExample {
  std::int64_t frame_index = 0;
  cv::Mat bgr;         // CV_8UC3
  cv::Mat depth;       // CV_32FC1
  cv::Mat confidence;  // CV_32FC1; may be empty
};

// A small picture of a frame without a pose.
struct LostImage {
  std::int64_t frame_index = 0;
  std::string name;
  cv::Mat bgr;
};

// What the report of a run shows that the result does not hold: collected while it goes on, of
// bounded size but for one FrameNote a frame. Any thread.
class RunNotes {
 public:
  void AddImage(const Frame& frame);
  void AddProgress(const PipelineProgress& progress);
  void AddDepthMap(const DepthMap& map);

  // In the order of the frames. Of a frame that came twice, the latest.
  std::vector<FrameNote> frames() const;
  std::vector<DepthExample> depth_examples() const;
  std::vector<LostImage> lost_images() const;
  // "DJI_0018.JPG" of photographs in any order, "frame 18" of frames that follow each other.
  std::string NameOf(std::int64_t frame_index) const;

  // All of it but the latest images, for the journal of a run, and back; see common/state_json.h.
  nlohmann::json ToJson() const;
  void TakeJson(const nlohmann::json& json);

 private:
  mutable std::mutex mutex_;
  std::deque<LostImage> latest_images_;
  // Reasons are few, and long runs have many frames.
  struct Note {
    bool is_tracked = false;
    std::size_t reason = 0;
  };
  std::map<std::int64_t, Note> notes_;
  std::map<std::int64_t, std::string> photos_;  // names of those in any order
  std::vector<std::string> reasons_;
  std::map<std::string, std::size_t> number_of_reason_;
  EvenSample<LostImage> lost_images_{64};
  EvenSample<DepthExample> depth_examples_{8};
};

// The frames of `source`, each told to `notes`, which must outlive it.
std::unique_ptr<FrameSource> WithNotes(std::unique_ptr<FrameSource> source, RunNotes& notes);

}  // namespace mono3d::tools
