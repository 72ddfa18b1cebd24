// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "run_report/run_notes.h"

#include <algorithm>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "common/state_json.h"
#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

constexpr int kThumbnailWidth_px = 192;
constexpr int kExampleWidth_px = 256;
// Live, a frame may wait before it is tracked.
constexpr std::size_t kMaxLatestImages = 64;

// Of a photograph that was to be looked at with all others, at the end, where that was not done:
// else it is told why it was not placed.
constexpr const char* kNoPlace = "the run ended before photographs were placed";

cv::Mat Small(const cv::Mat& image, int width_px, int interpolation) {
  if (image.cols <= width_px) return image.clone();
  const int height_px = std::max(1, image.rows * width_px / image.cols);
  cv::Mat small;
  cv::resize(image, small, {width_px, height_px}, 0, 0, interpolation);
  return small;
}

nlohmann::json ElementToJson(const LostImage& image) {
  return {image.frame_index, image.name, ImageToJson(image.bgr)};
}

nlohmann::json ElementToJson(const DepthExample& example) {
  return {example.frame_index, ImageToJson(example.bgr), ImageToJson(example.depth),
          ImageToJson(example.confidence)};
}

void TakeElement(const nlohmann::json& json, LostImage& image) {
  image = {json.at(0).get<std::int64_t>(), json.at(1).get<std::string>(),
           ImageFromJson(json.at(2))};
}

void TakeElement(const nlohmann::json& json, DepthExample& example) {
  example = {json.at(0).get<std::int64_t>(), ImageFromJson(json.at(1)), ImageFromJson(json.at(2)),
             ImageFromJson(json.at(3))};
}

template <typename Element>
nlohmann::json SampleToJson(const EvenSample<Element>& sample) {
  nlohmann::json elements = nlohmann::json::array();
  for (const Element& element : sample.elements()) elements.push_back(ElementToJson(element));
  return {{"step", sample.step()}, {"num_seen", sample.num_seen()}, {"elements", elements}};
}

template <typename Element>
void TakeSample(const nlohmann::json& json, EvenSample<Element>& sample) {
  std::vector<Element> elements;
  for (const nlohmann::json& element : json.at("elements")) {
    TakeElement(element, elements.emplace_back());
  }
  sample.Restore(std::move(elements), json.at("step").get<std::int64_t>(),
                 json.at("num_seen").get<std::int64_t>());
}

class NotedSource : public ForwardingSource {
 public:
  NotedSource(std::unique_ptr<FrameSource> source, RunNotes& notes)
      : ForwardingSource(std::move(source)), notes_(notes) {}

  std::optional<Frame> Next() override {
    std::optional<Frame> frame = ForwardingSource::Next();
    if (frame) notes_.AddImage(*frame);
    return frame;
  }

 private:
  RunNotes& notes_;
};

}  // namespace

void RunNotes::AddImage(const Frame& frame) {
  LostImage image{frame.index, frame.name, Small(frame.bgr, kThumbnailWidth_px, cv::INTER_NEAREST)};
  const std::lock_guard lock(mutex_);
  latest_images_.push_back(std::move(image));
  if (latest_images_.size() > kMaxLatestImages) latest_images_.pop_front();
}

void RunNotes::AddProgress(const PipelineProgress& progress) {
  const std::lock_guard lock(mutex_);
  const TrackingResult& tracking = progress.tracking;
  const bool is_tracked = tracking.status == TrackingStatus::kTracking && !tracking.is_pending;
  const std::string reason = tracking.is_pending ? kNoPlace : tracking.reason;
  const auto [number, is_new] =
      number_of_reason_.try_emplace(is_tracked ? "" : reason, reasons_.size());
  if (is_new) reasons_.push_back(number->first);
  notes_[progress.frame_index] = {is_tracked || tracking.is_pending, number->second};
  if (is_tracked) return;
  const auto image =
      std::ranges::find(latest_images_, progress.frame_index, &LostImage::frame_index);
  if (image == latest_images_.end()) return;
  if (tracking.is_pending) photos_[progress.frame_index] = image->name;
  if (lost_images_.TakesNext()) lost_images_.Add(*image);
}

void RunNotes::AddDepthMap(const DepthMap& map) {
  const std::lock_guard lock(mutex_);
  if (!depth_examples_.TakesNext()) return;
  DepthExample example;
  example.frame_index = map.frame_index;
  example.bgr = Small(map.bgr, kExampleWidth_px, cv::INTER_AREA);
  example.depth = Small(map.depth, kExampleWidth_px, cv::INTER_NEAREST);
  if (!map.confidence.empty()) {
    example.confidence = Small(map.confidence, kExampleWidth_px, cv::INTER_NEAREST);
  }
  depth_examples_.Add(std::move(example));
}

std::vector<FrameNote> RunNotes::frames() const {
  const std::lock_guard lock(mutex_);
  std::vector<FrameNote> frames;
  frames.reserve(notes_.size());
  for (const auto& [index, note] : notes_) {
    const auto photo = photos_.find(index);
    frames.push_back({index, note.is_tracked, reasons_[note.reason],
                      photo == photos_.end() ? std::string() : photo->second});
  }
  return frames;
}

std::string RunNotes::NameOf(std::int64_t frame_index) const {
  const std::lock_guard lock(mutex_);
  const auto photo = photos_.find(frame_index);
  return photo == photos_.end() ? "frame " + std::to_string(frame_index) : photo->second;
}

std::vector<DepthExample> RunNotes::depth_examples() const {
  const std::lock_guard lock(mutex_);
  return depth_examples_.elements();
}

std::vector<LostImage> RunNotes::lost_images() const {
  const std::lock_guard lock(mutex_);
  return lost_images_.elements();
}

nlohmann::json RunNotes::ToJson() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::uint8_t> frames;
  for (const auto& [index, note] : notes_) {
    AddRow(frames, index, static_cast<std::uint8_t>(note.is_tracked),
           static_cast<std::uint64_t>(note.reason));
  }
  return {{"reasons", reasons_},
          {"frames", nlohmann::json::binary(std::move(frames))},
          {"lost", SampleToJson(lost_images_)},
          {"depth", SampleToJson(depth_examples_)}};
}

void RunNotes::TakeJson(const nlohmann::json& json) {
  const std::lock_guard lock(mutex_);
  json.at("reasons").get_to(reasons_);
  number_of_reason_.clear();
  for (std::size_t i = 0; i < reasons_.size(); ++i) number_of_reason_[reasons_[i]] = i;
  notes_.clear();
  ForEachRow<std::int64_t, std::uint8_t, std::uint64_t>(
      json.at("frames"), [&](std::int64_t index, std::uint8_t is_tracked, std::uint64_t reason) {
        if (reason >= reasons_.size()) throw Error("the journal is damaged: no such reason");
        notes_[index] = {is_tracked != 0, reason};
      });
  TakeSample(json.at("lost"), lost_images_);
  TakeSample(json.at("depth"), depth_examples_);
}

std::unique_ptr<FrameSource> WithNotes(std::unique_ptr<FrameSource> source, RunNotes& notes) {
  return std::make_unique<NotedSource>(std::move(source), notes);
}

}  // namespace mono3d::tools
