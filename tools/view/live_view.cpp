// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/live_view.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <utility>
#include <vector>

#include "mono3d/core/timing.h"
#include "mono3d/io/depth_map_files.h"
#include "view/small_picture.h"
#include "view/up_direction.h"

namespace mono3d::tools {
namespace {

constexpr int kImageWidth_px = 480;
constexpr int kKeyframePictureWidth_px = 400;
constexpr double kMinPause_ms = 500;
// After this time without a request nobody watches: pages ask every second.
constexpr double kWatchedFor_s = 10;
constexpr std::size_t kMaxWaitingPictures = 16;

// Frames of another source, shown to a view as they pass.
class WatchedSource final : public ForwardingSource {
 public:
  WatchedSource(std::unique_ptr<FrameSource> source, LiveView& view)
      : ForwardingSource(std::move(source)), view_(view) {}

  std::optional<Frame> Next() override {
    std::optional<Frame> frame = ForwardingSource::Next();
    if (frame) view_.NoteFrame(frame->bgr);
    return frame;
  }

 private:
  LiveView& view_;
};

// Of this process, now.
double MemoryInUse_mb() {
  std::ifstream stream("/proc/self/statm");
  double size_pages = 0, resident_pages = 0;
  stream >> size_pages >> resident_pages;
  constexpr double kPage_mb = 4096.0 / (1 << 20);
  return resident_pages * kPage_mb;
}

// Of a model in the unit of its tracker.
nlohmann::json PlaceNumbers(const Georeference& found) {
  constexpr double kDegree = std::numbers::pi / 180;
  const Eigen::Vector3d& sigma_m = found.position_sigma_m;
  return {{"metres_per_unit", found.S_enu_map.scale()},
          {"scale_sigma", found.scale_sigma},
          {"heading_sigma_deg", found.heading_sigma_rad / kDegree},
          {"position_sigma_m", std::hypot(sigma_m.x(), sigma_m.y())}};
}

nlohmann::json ToJson(const PipelineCounts& counts) {
  return {{"frames", counts.num_frames},         {"dropped_frames", counts.num_dropped_frames},
          {"tracked", counts.num_tracked},       {"keyframes", counts.num_keyframes},
          {"bundles", counts.num_bundles},       {"dropped_bundles", counts.num_dropped_bundles},
          {"depth_maps", counts.num_depth_maps}, {"fused", counts.num_fused}};
}

// The map whose world is shown.
int MapInView(const PipelineSnapshot& snapshot) {
  if (snapshot.model_poses || !snapshot.pose) return snapshot.model_map_id;
  return snapshot.pose->map_id;
}

std::vector<Eigen::Vector3f> SomeNormals(const std::vector<ViewSurfel>& surfels) {
  constexpr std::size_t kMost = 64;
  std::vector<Eigen::Vector3f> normals;
  const std::size_t stride = std::max<std::size_t>(1, surfels.size() / kMost);
  for (std::size_t i = 0; i < surfels.size(); i += stride) normals.push_back(surfels[i].normal);
  return normals;
}

// Keyframes of different pipelines have the same numbers.
std::int64_t NumberInStore(std::int64_t keyframe_id, int pipeline) {
  constexpr int kBits = 40;
  return keyframe_id + (std::int64_t{pipeline} << kBits);
}

}  // namespace

LiveView::LiveView(const ViewArguments& arguments)
    : server_(arguments, store_, [this](const std::string& kind, std::int64_t id) {
        return store_.PictureOfKeyframe(kind, NumberInStore(id, pipeline_in_use_));
      }) {
  store_.SetStatus({{"phase", "starting"}});
}

LiveView::~LiveView() {
  try {
    End();
  } catch (...) {  // it was not asked for
  }
}

std::unique_ptr<FrameSource> LiveView::Watched(std::unique_ptr<FrameSource> source) {
  store_.SetCamera(source->camera());
  return std::make_unique<WatchedSource>(std::move(source), *this);
}

void LiveView::NoteFrame(const cv::Mat& bgr) {
  const double now_ms = WallClockMs();
  if (now_ms - image_taken_ms_ < kMinPause_ms || store_.SecondsSinceAsked() > kWatchedFor_s) return;
  image_taken_ms_ = now_ms;  // by the thread of the frames alone
  cv::Mat small = SmallPicture(bgr, kImageWidth_px, cv::INTER_AREA);
  const std::lock_guard lock(pictures_mutex_);
  image_ = std::move(small);
}

void LiveView::NoteDepthMap(const DepthMap& map, int pipeline) {
  KeyframePicture picture{NumberInStore(map.keyframe_id, pipeline),
                          SmallPicture(map.bgr, kKeyframePictureWidth_px, cv::INTER_AREA),
                          SmallPicture(map.depth, kKeyframePictureWidth_px, cv::INTER_NEAREST)};
  const std::lock_guard lock(pictures_mutex_);
  keyframe_pictures_.push_back(std::move(picture));
  if (keyframe_pictures_.size() > kMaxWaitingPictures) keyframe_pictures_.pop_front();
}

void LiveView::Begin(TakeSnapshot take_snapshot, std::optional<std::int64_t> num_frames) {
  End();
  take_snapshot_ = std::move(take_snapshot);
  num_frames_ = num_frames;
  must_end_ = false;
  thread_ = std::thread([this] { Work(); });
}

void LiveView::End() {
  if (thread_.joinable()) {
    {
      const std::lock_guard lock(mutex_);
      must_end_ = true;
    }
    ended_.notify_all();
    thread_.join();
    take_snapshot_ = {};
  }
  if (std::exception_ptr error = std::exchange(error_, nullptr)) std::rethrow_exception(error);
}

void LiveView::Work() {
  double pause_ms = 0;
  for (bool is_last = false; !is_last;) {
    {
      std::unique_lock lock(mutex_);
      const auto pause = std::chrono::duration<double, std::milli>(pause_ms);
      is_last = ended_.wait_for(lock, pause, [this] { return must_end_; });
    }
    const double start_ms = WallClockMs();
    try {
      Update(is_last);
    } catch (...) {
      error_ = std::current_exception();
      return;
    }
    pause_ms = std::max(kMinPause_ms, 4 * (WallClockMs() - start_ms));
  }
}

void LiveView::Update(bool is_last) {
  UpdatePictures();
  const double since_asked_s = store_.SecondsSinceAsked();
  // A tab that is asleep asks again when it is woken: what there was last is kept for it.
  const bool was_ever_asked = since_asked_s < ViewStore::kNeverAsked_s;
  if (since_asked_s > kWatchedFor_s && !(is_last && was_ever_asked)) return;
  PipelineSnapshot snapshot = take_snapshot_(version_);
  CountConfidences(snapshot.surfels);
  if (ChooseLimit()) {
    snapshot = take_snapshot_(0);
    CountConfidences(snapshot.surfels);
  }
  UpdateModel(snapshot);
  UpdateWay(snapshot);
  UpdateStatus(snapshot, is_last ? "finished" : "running");
}

void LiveView::CountConfidences(const SurfelChanges& changes) {
  std::set<std::int64_t> ids;
  for (const SurfelAnchor& anchor : changes.anchors) ids.insert(anchor.number);
  std::erase_if(confidences_, [&](const auto& entry) { return !ids.contains(entry.first); });
  for (const SurfelChunk& chunk : changes.changed) {
    ConfidenceHistogram& of_block = confidences_[chunk.anchor];
    of_block = {};
    of_block.Add(*chunk.surfels);
  }
}

// Whether surfels of another confidence than before are shown from now on, by what the model has
// become. For less than half an octave it is not sent anew.
bool LiveView::ChooseLimit() {
  ConfidenceHistogram of_model;
  for (const auto& [id, of_block] : confidences_) of_model.Add(of_block);
  const SurfelExportOptions options;
  const double limit = of_model.LimitFor(options);
  const double octaves = std::log2(limit / min_confidence_);
  const bool is_other =
      std::abs(octaves) >= 0.5 || (octaves > 0 && limit == options.min_confidence);
  if (is_other) min_confidence_ = limit;
  return is_other;
}

void LiveView::UpdateModel(const PipelineSnapshot& snapshot) {
  const SurfelChanges& changes = snapshot.surfels;
  std::vector<std::int64_t> ids;
  std::optional<FrameTime> first, last;
  S_world_block_.clear();
  for (const SurfelAnchor& anchor : changes.anchors) {
    ids.push_back(anchor.number);
    const FrameTime time{anchor.frame_index, anchor.timestamp_s};
    if (!first || time.frame_index < first->frame_index) first = time;
    if (!last || time.frame_index > last->frame_index) last = time;
    S_world_block_[anchor.number] = anchor.S_world_anchor;
  }
  std::vector<SurfelBlock> blocks;
  for (const SurfelChunk& chunk : changes.changed) {
    const auto S_world_block = S_world_block_.find(chunk.anchor);
    if (S_world_block == S_world_block_.end()) continue;
    std::vector<ViewSurfel> surfels = ToViewSurfels(*chunk.surfels, min_confidence_);
    normals_[chunk.anchor] = SomeNormals(surfels);
    SurfelBlock block = MakeSurfelBlock(std::move(surfels));
    block.id = chunk.anchor;
    block.S_world_block = S_world_block->second;
    blocks.push_back(std::move(block));
  }
  store_.SetModel(ids, std::move(blocks));
  store_.SetTransforms(S_world_block_);
  if (first && last) store_.SetTimes(*first, *last);
  std::erase_if(normals_, [&](const auto& entry) { return !S_world_block_.contains(entry.first); });
  version_ = changes.version;
}

void LiveView::UpdateWay(const PipelineSnapshot& snapshot) {
  std::vector<ViewPose> keyframes;
  std::vector<Pose> poses;
  for (const KeyframePose& pose : snapshot.keyframe_poses->poses()) {
    if (pose.map_id != MapInView(snapshot)) continue;
    keyframes.push_back({.id = pose.keyframe_id, .T_world_cam = pose.T_world_cam()});
    poses.push_back(pose.T_world_cam());
  }
  store_.SetKeyframes(std::move(keyframes));
  UpdateUp(poses);
}

// Again where keyframes or blocks are a tenth more, or fewer as of another map: less hardly turns
// it. Photographs have all their keyframes before the first block.
void LiveView::UpdateUp(std::span<const Pose> T_world_cam) {
  const auto is_as_before = [](std::size_t num, std::size_t before) {
    return num == before || (num > before && 10 * num < 11 * before);
  };
  if (is_as_before(T_world_cam.size(), num_keyframes_of_up_) &&
      is_as_before(normals_.size(), num_blocks_of_up_)) {
    return;
  }
  num_keyframes_of_up_ = T_world_cam.size();
  num_blocks_of_up_ = normals_.size();
  std::vector<Eigen::Vector3f> normals;
  for (const auto& [id, of_block] : normals_) {
    const Eigen::Quaternionf R = S_world_block_[id].pose().rotation().cast<float>();
    for (const Eigen::Vector3f& normal : of_block) normals.push_back(R * normal);
  }
  store_.SetUp(UpDirection(T_world_cam, normals));
}

void LiveView::UpdateStatus(const PipelineSnapshot& snapshot, const char* phase) {
  nlohmann::json status = {{"phase", phase},
                           {"frame", snapshot.frame_index},
                           {"tracking", ToString(snapshot.status)},
                           {"reason", snapshot.reason},
                           {"surfels", snapshot.num_surfels},
                           {"counts", ToJson(snapshot.counts)},
                           {"health", ToString(snapshot.health.state)},
                           {"health_reason", snapshot.health.reason},
                           {"memory_mb", MemoryInUse_mb()}};
  if (num_frames_) status["num_frames"] = *num_frames_;
  if (snapshot.pose && snapshot.pose->map_id == MapInView(snapshot)) {
    status["pose"] = PoseNumbers(snapshot.pose->T_world_cam);
  }
  if (snapshot.place && snapshot.place->map_id == MapInView(snapshot)) {
    status["earth"] = PlaceNumbers(snapshot.place->georeference);
  }
  store_.SetStatus(std::move(status));
}

void LiveView::UpdatePictures() {
  cv::Mat image;
  std::deque<KeyframePicture> pictures;
  {
    const std::lock_guard lock(pictures_mutex_);
    std::swap(image, image_);
    pictures.swap(keyframe_pictures_);
  }
  if (!image.empty()) store_.SetPicture("image", ToJpeg(image));
  for (const KeyframePicture& picture : pictures) {
    if (picture.bgr.empty() || picture.depth.empty()) continue;
    const SharedBytes depth = ToJpeg(DepthPreview(picture.depth));
    store_.SetPictureOfKeyframe("image", picture.keyframe, ToJpeg(picture.bgr));
    store_.SetPictureOfKeyframe("depth", picture.keyframe, depth);
    store_.SetPicture("depth", depth);
  }
}

}  // namespace mono3d::tools
