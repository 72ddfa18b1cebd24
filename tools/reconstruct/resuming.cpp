// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/resuming.h"

#include <bit>
#include <functional>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/tool.h"
#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

std::uint64_t Hashed(std::uint64_t before, std::string_view bytes) {
  const std::uint64_t hash = std::hash<std::string_view>{}(bytes);
  constexpr std::uint64_t kOddFactor = 0x9E3779B97F4A7C15U;  // the golden ratio's: mixes all bits
  return (std::rotl(before, 23) ^ hash) * kOddFactor;
}

class DigestedSource : public ForwardingSource {
 public:
  DigestedSource(std::unique_ptr<FrameSource> source, InputDigest& digest)
      : ForwardingSource(std::move(source)), digest_(digest) {}

  std::optional<Frame> Next() override {
    std::optional<Frame> frame = ForwardingSource::Next();
    if (frame) digest_.Add(*frame);
    return frame;
  }

 private:
  InputDigest& digest_;
};

// The images of those frames, of all up to `last_frame`.
std::map<std::int64_t, cv::Mat> ReadUpTo(std::int64_t last_frame,
                                         const std::vector<std::int64_t>& wanted,
                                         FrameSource& source) {
  const std::set<std::int64_t> indices(wanted.begin(), wanted.end());
  std::map<std::int64_t, cv::Mat> images;
  std::int64_t index = -1;
  while (index < last_frame) {
    std::optional<Frame> frame = source.Next();
    if (!frame) {
      throw Error(ErrorParts{.what = "the input has become shorter since the run was broken off: "
                                     "start anew without --resume",
                             .where = {},
                             .expected = "frame " + std::to_string(last_frame),
                             .found = "frame " + std::to_string(index) + " is the last one"});
    }
    index = frame->index;
    if (StopRequested()) throw Error("stopped before the run was where it had been");
    if (indices.contains(index)) images[index] = std::move(frame->bgr);
  }
  return images;
}

}  // namespace

void InputDigest::Add(const Frame& frame) {
  value_ = Hashed(value_ ^ static_cast<std::uint64_t>(frame.index), frame.name);
  const std::size_t row_size = static_cast<std::size_t>(frame.bgr.cols) * frame.bgr.elemSize();
  for (int row = 0; row < frame.bgr.rows; ++row) {
    value_ = Hashed(value_, {frame.bgr.ptr<char>(row), row_size});
  }
}

std::unique_ptr<FrameSource> WithDigest(std::unique_ptr<FrameSource> source, InputDigest& digest) {
  return std::make_unique<DigestedSource>(std::move(source), digest);
}

nlohmann::json PutRun(const JournaledRun& run, const EarlierParts& earlier, double wall_s,
                      StateFolder& states) {
  nlohmann::json own;
  run.pipeline.SaveState(states, [&] {
    nlohmann::json stages = nlohmann::json::array();
    for (const StageTime& time : run.times.Snapshot()) {
      stages.push_back({time.stage, time.num_calls, time.wall_ms, time.gpu_ms, time.cpu_ms});
    }
    own = {{"frames", run.frames.ToJson()},      {"notes", run.notes.ToJson()},
           {"files", run.files.ToJson()},        {"stages", stages},
           {"wall_s", earlier.wall_s + wall_s},  {"cpu_s", earlier.cpu_s + 1e-3 * ProcessCpuMs()},
           {"last_frames", earlier.last_frames}, {"input", run.input.value()}};
  });
  return own;
}

EarlierParts Resume(RunJournal& journal, FrameSource& source, const JournaledRun& run) {
  const nlohmann::json state = journal.ReadState();
  const std::map<std::int64_t, cv::Mat> images =
      ReadUpTo(journal.last_frame(), Pipeline::FramesOfState(journal.states()), source);
  // Else the result would be of images that this input never had together.
  if (!state.contains("input") || state["input"] != run.input.value()) {
    throw Error(
        "the images have changed since the run was broken off: start anew without --resume");
  }
  try {
    run.frames.TakeJson(state.at("frames"));
    run.notes.TakeJson(state.at("notes"));
    run.files.TakeJson(state.at("files"));
    run.files.RemoveOtherDepthMaps(journal.last_frame());
    for (const nlohmann::json& time : state.at("stages")) {
      run.times.Add({.stage = time.at(0).get<std::string>(),
                     .num_calls = time.at(1).get<std::int64_t>(),
                     .wall_ms = time.at(2).get<double>(),
                     .gpu_ms = time.at(3).get<double>(),
                     .cpu_ms = time.at(4).get<double>()});
    }
    EarlierParts earlier{state.at("wall_s").get<double>(), state.at("cpu_s").get<double>(),
                         state.at("last_frames").get<std::vector<std::int64_t>>()};
    earlier.last_frames.push_back(journal.last_frame());
    // Last: from then on more may be noted.
    run.pipeline.RestoreState(journal.states(), [&](std::int64_t index) {
      const auto found = images.find(index);
      return found == images.end() ? cv::Mat() : found->second.clone();
    });
    return earlier;
  } catch (const nlohmann::json::exception& error) {
    throw Error(ErrorParts{.what = "the journal is damaged: start anew without --resume",
                           .where = journal.states().path().string(),
                           .expected = {},
                           .found = error.what()});
  }
}

}  // namespace mono3d::tools
