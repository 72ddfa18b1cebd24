// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Films with the faults of real ones through the whole chain, in order and live: the run ends in
// order, has a model of what could be tracked, and counts and names what could not.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "gpu/test_device.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/pipeline/pipeline.h"
#include "tracking/tracking_world.h"

namespace mono3d {
namespace {

constexpr double kFlyingHeight = 10;  // of the flight over flat ground
// Of the height; as for flights without faults over the same ground.
constexpr double kMaxError = 0.01;
// Of the height: five times the standard deviation of a depth map over so short a baseline.
constexpr double kMaxOffGround = 0.02;
// Surfels farther off it: of the borders of depth maps.
constexpr double kMaxFalseSurfels = 0.01;
constexpr std::size_t kBefore = 16;  // frames: the map stands, and there is depth
constexpr std::size_t kAll = 34;

// Rendered once for all tests.
const tracking::Sequence& CleanFlight() {
  static const tracking::Sequence flight =
      tracking::FlyOver(tracking::TexturedGround(false), static_cast<int>(kAll));
  return flight;
}

struct FaultyFilm {
  std::vector<Frame> frames;
  std::vector<std::optional<Pose>> T_world_cam;  // nothing where the ground is not seen

  void Add(const cv::Mat& bgr, const std::optional<Pose>& T) {
    const auto index = static_cast<std::int64_t>(frames.size());
    Frame frame = tracking::BlackFrame(index);
    frame.timestamp_s = 0.1 * static_cast<double>(index);
    frame.bgr = bgr;
    frames.push_back(std::move(frame));
    T_world_cam.push_back(T);
  }
  void Add(std::size_t i) { Add(CleanFlight().frames[i].bgr, CleanFlight().T_world_cam[i]); }
  void Add(std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) Add(i);
  }
};

cv::Mat Mirrored(std::size_t i) {
  cv::Mat mirrored;
  cv::flip(CleanFlight().frames[i].bgr, mirrored, 1);
  return mirrored;
}

std::int64_t NumUntracked(const PipelineCounts& counts) {
  std::int64_t sum = 0;
  for (const auto& [reason, times] : counts.untracked_frames) {
    EXPECT_FALSE(reason.empty());
    sum += times;
  }
  return sum;
}

// Parameter: live?
class FaultyFilmRun : public testing::TestWithParam<bool> {
 protected:
  static Reconstruction Run(const FaultyFilm& film) {
    PipelineOptions options;
    options.is_live = GetParam();
    // However slow the machine is.
    options.live.max_delay_s = 3600;
    options.live.max_waiting_mb = 1e6;
    options.live.max_waiting_bundles = 1000;
    Pipeline pipeline(CreateStages(options, TestDevice()), {}, options);
    if (options.is_live) pipeline.Start();
    for (const Frame& frame : film.frames) {
      if (options.is_live) {
        EXPECT_TRUE(pipeline.Push(frame).dropped.empty());
      } else {
        pipeline.Process(frame);
      }
    }
    Reconstruction result = options.is_live ? pipeline.Stop() : pipeline.Finish();
    const PipelineCounts& counts = result.counts;
    EXPECT_EQ(counts.num_frames, static_cast<std::int64_t>(film.frames.size()));
    EXPECT_EQ(counts.num_tracked + NumUntracked(counts), counts.num_frames);
    return result;
  }

  // The flight is nearly straight: its places alone leave open how the model is rolled about it, so
  // each camera adds the points a flying height away along its axes.
  static Similarity FitToTruth(const MapReconstruction& map, std::vector<Eigen::Vector3d> found,
                               std::vector<Eigen::Vector3d> truth, const FaultyFilm& film) {
    const double scale = FitSimilarity(found, truth).scale();
    for (const TrajectoryEntry& entry : map.trajectory) {
      const Pose& T_found = entry.T_world_cam;
      const Pose& T_true = *film.T_world_cam[static_cast<std::size_t>(entry.frame_index)];
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d p_cam = kFlyingHeight * Eigen::Vector3d::Unit(axis);
        found.push_back(T_found * Eigen::Vector3d(p_cam / scale));
        truth.push_back(T_true * p_cam);
      }
    }
    return FitSimilarity(found, truth);
  }

  // So many of the film's frames lie where they were taken, and the model on the ground.
  static void ExpectGood(const MapReconstruction& map, const FaultyFilm& film,
                         std::size_t min_frames) {
    EXPECT_GE(map.trajectory.size(), min_frames);
    std::vector<Eigen::Vector3d> found;
    std::vector<Eigen::Vector3d> truth;
    for (const TrajectoryEntry& entry : map.trajectory) {
      const auto& T = film.T_world_cam.at(static_cast<std::size_t>(entry.frame_index));
      ASSERT_TRUE(T.has_value()) << "frame " << entry.frame_index << " shows nothing";
      found.push_back(entry.T_world_cam.translation());
      truth.push_back(T->translation());
    }
    ASSERT_GE(found.size(), 3U);
    const Similarity fit = FitToTruth(map, found, truth, film);
    double sum = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      sum += (fit * found[i] - truth[i]).squaredNorm();
    }
    EXPECT_LT(std::sqrt(sum / static_cast<double>(found.size())) / kFlyingHeight, kMaxError);
    ASSERT_GT(map.model.points.size(), 1000U);
    std::size_t num_off = 0;
    for (const auto& p : map.model.points) {
      const Eigen::Vector3d p_ground = fit * p.template cast<double>();
      num_off += std::abs(p_ground.z()) > kMaxOffGround * kFlyingHeight ? 1 : 0;
    }
    EXPECT_LT(static_cast<double>(num_off),
              kMaxFalseSurfels * static_cast<double>(map.model.points.size()));
  }

  static void ExpectOneGoodModel(const FaultyFilm& film, std::size_t min_frames) {
    const Reconstruction result = Run(film);
    ASSERT_EQ(result.maps.size(), 1U);
    ExpectGood(result.maps[0], film, min_frames);
  }
};

// Those before the start get their poses afterwards.
TEST_P(FaultyFilmRun, WithoutFaults) {
  FaultyFilm film;
  film.Add(0, kAll);
  ExpectOneGoodModel(film, kAll);
}

TEST_P(FaultyFilmRun, BlackFramesAreCountedAndNamed) {
  FaultyFilm film;
  film.Add(0, kBefore);
  for (int i = 0; i < 10; ++i) film.Add(tracking::BlackFrame(0).bgr, std::nullopt);
  film.Add(kBefore + 1, kAll);
  const Reconstruction result = Run(film);
  ASSERT_EQ(result.maps.size(), 1U);
  ExpectGood(result.maps[0], film, kAll - 1);
  EXPECT_GE(NumUntracked(result.counts), 10);
}

TEST_P(FaultyFilmRun, AFrozenSecond) {
  FaultyFilm film;
  film.Add(0, kBefore);
  for (int i = 0; i < 10; ++i) film.Add(kBefore);
  film.Add(kBefore + 1, kAll);
  ExpectOneGoodModel(film, film.frames.size());
}

TEST_P(FaultyFilmRun, EachFrameTwice) {
  FaultyFilm film;
  for (std::size_t i = 0; i < 2 * kAll; ++i) film.Add(i / 2);
  ExpectOneGoodModel(film, film.frames.size());
}

TEST_P(FaultyFilmRun, SwappedFrames) {
  FaultyFilm film;
  for (std::size_t i = 0; i < kAll; ++i) film.Add(i % 8 == 3 ? i + 1 : i % 8 == 4 ? i - 1 : i);
  ExpectOneGoodModel(film, kAll);
}

TEST_P(FaultyFilmRun, DroppedFrames) {
  FaultyFilm film;
  for (std::size_t i = 0; i < kAll; ++i) {
    if (i % 5 != 2 && i != kBefore && i != kBefore + 1) film.Add(i);
  }
  ExpectOneGoodModel(film, film.frames.size());
}

TEST_P(FaultyFilmRun, JumpsOfTheExposure) {
  FaultyFilm film;
  for (std::size_t i = 0; i < kAll; ++i) {
    cv::Mat image = CleanFlight().frames[i].bgr;
    if (i / 9 % 2 == 1) {
      image = image.clone();
      image.convertTo(image, -1, 0.5, 10);
    }
    film.Add(image, CleanFlight().T_world_cam[i]);
  }
  ExpectOneGoodModel(film, kAll);
}

// The mirrored flight is one over other ground, on the mirrored way.
TEST_P(FaultyFilmRun, ACutToAnotherPlaceMakesAnotherMap) {
  FaultyFilm film;
  film.Add(0, kAll);
  for (std::size_t i = 0; i + 8 < kAll; ++i) film.Add(Mirrored(i), std::nullopt);
  // Longer than a lost track is waited for.
  for (std::size_t i = kAll; i < film.frames.size(); ++i) film.frames[i].timestamp_s += 60;
  const Reconstruction result = Run(film);
  ASSERT_EQ(result.maps.size(), 2U);
  ExpectGood(result.maps[0], film, kAll);
  EXPECT_GE(result.maps[1].trajectory.size(), kAll / 2);
  EXPECT_GE(NumUntracked(result.counts), 1);
}

TEST_P(FaultyFilmRun, AClockThatJumpsBackAndOneThatStandsStill) {
  if (GetParam())
    GTEST_SKIP() << "Push refuses them: LiveClock keeps the times of a camera in order";
  FaultyFilm film;
  film.Add(0, kAll);
  for (std::size_t i = kBefore; i < kAll; ++i) film.frames[i].timestamp_s -= 100;
  for (std::size_t i = kBefore + 6; i < kBefore + 10; ++i) {
    film.frames[i].timestamp_s = film.frames[kBefore + 5].timestamp_s;
  }
  ExpectOneGoodModel(film, kAll);
}

INSTANTIATE_TEST_SUITE_P(InOrder, FaultyFilmRun, testing::Values(false));
INSTANTIATE_TEST_SUITE_P(Live, FaultyFilmRun, testing::Values(true));

}  // namespace
}  // namespace mono3d
