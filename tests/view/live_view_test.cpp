// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/live_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "mono3d/core/error.h"
#include "view/http_client.h"

namespace mono3d::tools {
namespace {

int PortOf(const std::string& url) { return std::stoi(url.substr(url.rfind(':') + 1)); }

PipelineSnapshot AtFrame(std::int64_t frame) {
  PipelineSnapshot snapshot;
  snapshot.frame_index = frame;
  snapshot.keyframe_poses = std::make_shared<const KeyframePoses>();
  return snapshot;
}

// Until the view has taken a snapshot for a viewer.
void WaitForSnapshot(const std::atomic<int>& num_snapshots) {
  for (int i = 0; i < 600 && num_snapshots == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ASSERT_GT(num_snapshots, 0);
}

TEST(LiveView, AsksTheRunForNothingWhileNobodyWatches) {
  LiveView view({});
  std::atomic<int> num_snapshots = 0;
  view.Begin(
      [&](std::uint64_t) {
        ++num_snapshots;
        return AtFrame(1);
      },
      {});
  view.NoteFrame(cv::Mat(48, 64, CV_8UC3, cv::Scalar(1, 2, 3)));
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  view.End();
  EXPECT_EQ(num_snapshots, 0);
  EXPECT_EQ(view.store().Picture("image"), nullptr);
}

TEST(LiveView, ShowsFramesAndDepthToAViewer) {
  LiveView view({});
  (void)Get(PortOf(view.url()), "/changes?since=0");
  view.NoteFrame(cv::Mat(48, 64, CV_8UC3, cv::Scalar(1, 2, 3)));
  DepthMap map;
  map.bgr = cv::Mat(48, 64, CV_8UC3, cv::Scalar(1, 2, 3));
  map.depth = cv::Mat(48, 64, CV_32FC1, cv::Scalar(2));
  map.keyframe_id = 7;
  const int first = view.NotePipeline();
  view.NoteDepthMap(map, first);
  view.Begin([](std::uint64_t) { return AtFrame(5); }, 20);
  view.End();
  const nlohmann::json changes =
      nlohmann::json::parse(Get(PortOf(view.url()), "/changes?since=0").body);
  EXPECT_EQ(changes["status"]["frame"], 5);
  EXPECT_EQ(changes["status"]["num_frames"], 20);
  EXPECT_EQ(changes["status"]["phase"], "finished");
  for (const char* name : {"/image", "/depth", "/keyframe_image?id=7", "/keyframe_depth?id=7"}) {
    EXPECT_THAT(Get(PortOf(view.url()), name).body, testing::StartsWith("\xff\xd8")) << name;
  }
  EXPECT_EQ(Get(PortOf(view.url()), "/keyframe_image?id=8").status, 404);
  // The keyframe of that number is another one in the pipeline that takes over.
  (void)view.NotePipeline();
  EXPECT_EQ(Get(PortOf(view.url()), "/keyframe_image?id=7").status, 200);
  view.UseLatestPipeline();
  EXPECT_EQ(Get(PortOf(view.url()), "/keyframe_image?id=7").status, 404);
}

// A pipeline tells its error once.
TEST(LiveView, HandsOnTheErrorOfTheRun) {
  LiveView view({});
  (void)Get(PortOf(view.url()), "/changes?since=0");
  std::atomic<int> num_snapshots = 0;
  view.Begin(
      [&](std::uint64_t) -> PipelineSnapshot {
        ++num_snapshots;
        throw Error("the device is lost");
      },
      {});
  WaitForSnapshot(num_snapshots);
  EXPECT_THROW(view.End(), Error);
  EXPECT_NO_THROW(view.End());
  EXPECT_EQ(num_snapshots, 1);
}

TEST(LiveView, LeavesOutWhatIsUncertainAndWhatIsNoMore) {
  LiveView view({});
  const int port = PortOf(view.url());
  PointCloud cloud;
  for (int i = 0; i < 10; ++i) {
    cloud.points.emplace_back(static_cast<float>(i), 0.0F, 1.0F);
    cloud.normals.emplace_back(0, 0, -1);
    cloud.radii.push_back(0.1F);
    cloud.confidences.push_back(i < 4 ? 0.05F : 0.5F);
    cloud.colours.push_back({1, 2, 3});
    cloud.observations.push_back(1);
    cloud.first_frames.push_back(i < 9 ? 2 : 3);
  }
  const auto surfels = std::make_shared<const PointCloud>(cloud);
  const auto with_anchors = [&](std::vector<std::uint32_t> numbers) {
    (void)Get(port, "/changes?since=0");
    view.Begin(
        [&, numbers](std::uint64_t) {
          PipelineSnapshot snapshot = AtFrame(1);
          for (const std::uint32_t number : numbers) {
            SurfelAnchor& anchor = snapshot.surfels.anchors.emplace_back();
            anchor.number = number;
            anchor.frame_index = 3 + number;
            anchor.timestamp_s = 0.5 * number;
            snapshot.surfels.changed.push_back({number, surfels});
          }
          return snapshot;
        },
        {});
    view.End();
    return nlohmann::json::parse(Get(port, "/changes?since=0").body);
  };
  const nlohmann::json two = with_anchors({1, 2});
  ASSERT_EQ(two["blocks"].size(), 2U);
  EXPECT_EQ(two["blocks"][0]["surfels"], 6);
  EXPECT_EQ(two["blocks"][0]["frames"], nlohmann::json({2, 3}));
  EXPECT_EQ(two["times"]["frames"], nlohmann::json({4, 5}));
  EXPECT_EQ(two["times"]["seconds"], nlohmann::json({0.5, 1.0}));
  const nlohmann::json one = with_anchors({2});
  ASSERT_EQ(one["blocks"].size(), 1U);
  EXPECT_EQ(one["ids"], nlohmann::json({2}));
}

// The first depth maps of a camera that hardly moves: the surest of what there is, until there is
// more. What was sent with another limit is sent anew.
TEST(LiveView, ShowsTheSurestWhereHardlyAnythingIsSure) {
  LiveView view({});
  const int port = PortOf(view.url());
  const auto chunk_of = [](float confidence) {
    PointCloud cloud;
    for (int i = 0; i < 10; ++i) {
      cloud.points.emplace_back(static_cast<float>(i), 0.0F, 1.0F);
      cloud.normals.emplace_back(0, 0, -1);
      cloud.radii.push_back(0.1F);
      cloud.confidences.push_back(confidence * (i < 5 ? 1.0F : 0.1F));
      cloud.colours.push_back({1, 2, 3});
      cloud.observations.push_back(1);
    }
    return std::make_shared<const PointCloud>(cloud);
  };
  std::vector<SurfelChunk> chunks = {{1, chunk_of(0.05F)}};
  std::vector<std::uint64_t> asked_for;
  const auto show = [&] {
    (void)Get(port, "/changes?since=0");
    asked_for.clear();
    view.Begin(
        [&](std::uint64_t since) {
          asked_for.push_back(since);
          PipelineSnapshot snapshot = AtFrame(1);
          snapshot.surfels.version = chunks.size();
          for (const SurfelChunk& chunk : chunks) {
            snapshot.surfels.anchors.emplace_back().number = chunk.anchor;
            if (chunk.anchor > since) snapshot.surfels.changed.push_back(chunk);
          }
          return snapshot;
        },
        {});
    view.End();
    return nlohmann::json::parse(Get(port, "/changes?since=0").body);
  };
  const nlohmann::json unsure = show();
  ASSERT_EQ(unsure["blocks"].size(), 1U);
  EXPECT_EQ(unsure["blocks"][0]["surfels"], 5);
  // Both of 0.5 and of 0.05 are half of the model: what an export would have is enough.
  chunks.push_back({2, chunk_of(0.5F)});
  const nlohmann::json sure = show();
  EXPECT_EQ(asked_for.front(), 1U);
  EXPECT_EQ(asked_for.back(), 0U);
  std::map<int, int> num_surfels;
  for (const nlohmann::json& block : sure["blocks"]) num_surfels[block["id"]] = block["surfels"];
  EXPECT_EQ(num_surfels[1], 0);
  EXPECT_EQ(num_surfels[2], 5);
}

}  // namespace
}  // namespace mono3d::tools
