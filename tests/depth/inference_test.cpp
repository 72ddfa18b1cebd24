// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/inference.h"

#include <algorithm>
#include <cmath>

#include "depth/inference_tiles.h"
#include "depth/sky.h"
#include "depth/stage_testing.h"
#include "reference/depth/inference_reference.h"

namespace mono3d {
namespace {

using reference::InferenceMap;
using Texel = InferenceMap::value_type;

// Float against double: a few roundings.
constexpr float kRelative = 2e-5F;

// Of sky, of a plane that is believed as a whole or not, matched on a coarser level, or none of it.
InferenceMap RandomCells(LevelSize size, std::mt19937& random) {
  InferenceMap cells(std::size_t{(size.width_px + 3) / 4} * ((size.height_px + 3) / 4));
  for (Texel& cell : cells) {
    const auto values = RandomValues(4, 0.1F, 1, 0, random);
    const bool is_sky = random() % 4 == 0;
    const bool is_plane = !is_sky && random() % 2 == 0;
    const float confidence = is_plane ? 0.125F * values[3] : 0.F;
    const bool is_believed = is_plane && random() % 2 == 0;
    cell = {values[0], 0.1F * values[1], -0.1F * values[2],
            is_sky ? -1.F : (is_believed ? 1.F + confidence : confidence)};
    if (is_sky || is_plane) continue;
    const bool is_coarse = random() % 2 == 0;
    cell = {2 * values[0], is_coarse ? 0.1F * values[1] : 0.F, 0.125F * values[2], 0.F};
  }
  return cells;
}

// Inverse depth 0.5 to 2, of which some have no weight; and the rest of a texel below 1 or 256.
InferenceMap RandomMap(LevelSize size, bool is_state, std::mt19937& random) {
  const std::size_t n = size.num_pixels();
  const auto depth = RandomValues(n, 0.5F, 2, 0, random);
  const auto weight = RandomValues(n, 0, 1, is_state ? 0 : 0.5, random);
  const auto confidence = RandomValues(n, 0, 1, 0, random);
  const auto grey = RandomValues(n, 0, 60, 0, random);
  InferenceMap map;
  for (std::size_t i = 0; i < n; ++i) {
    if (is_state) {
      map.push_back({depth[i], confidence[i], grey[i], 0.F});
    } else {
      map.push_back({weight[i] > 0 ? depth[i] : 0.F, weight[i], confidence[i], grey[i]});
    }
  }
  return map;
}

// Each sees the reference's pixels some pixels farther to the left.
SourceProjections SourcesToTheRight(std::size_t num_sources) {
  SourceProjections projections;
  for (std::size_t i = 0; i < num_sources; ++i) {
    projections.push_back(
        {Eigen::Matrix3d::Identity(), Eigen::Vector3d(-2.37 * double(i), 0.21, 0)});
  }
  return projections;
}

void ExpectNear(const InferenceMap& found, const InferenceMap& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      ASSERT_NEAR(found[i][j], expected[i][j], kRelative * (1 + std::abs(expected[i][j])))
          << i << " " << j;
    }
  }
}

TEST(InferenceData, EqualsReference) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSmallSizes) {
    const std::size_t n = size.num_pixels();
    const auto depth = RandomValues(n, 0.5F, 2, 0.5, random);
    const auto inverse_depth = RandomValues(n, 0.5F, 2, 0.3, random);
    const auto confidence = RandomValues(n, 0, 1, 0, random);
    const cv::Mat halved = RandomImage(size.Halved(), random);
    const InferenceMap cells = RandomCells(size, random);
    const Buffer data = MakeBuffer<Texel>(size.Halved().num_pixels());
    Recorder recorder(TestDevice());
    const Buffer whole = MakeBuffer<float>(n);
    TestKernels().InferenceData(recorder, size, {ToBuffer(inverse_depth), ToBuffer(confidence)},
                                ToBuffer(depth), ImagesToBuffer({halved}), ToBuffer(cells), data,
                                whole);
    recorder.Submit();
    const auto inverse_of_depth = FirstOf<float>(whole, n);
    for (std::size_t i = 0; i < n; ++i) {
      ASSERT_NEAR(inverse_of_depth[i], depth[i] > 0 ? 1 / depth[i] : 0, kRelative * 2);
    }
    ExpectNear(FirstOf<Texel>(data, size.Halved().num_pixels()),
               reference::InferenceData(size, depth, {inverse_depth, confidence}, halved, cells));
  }
}

TEST(InferenceHalve, EqualsReference) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSmallSizes) {
    const InferenceMap fine = RandomMap(size, false, random);
    const Buffer coarse = MakeBuffer<Texel>(size.Halved().num_pixels());
    Recorder recorder(TestDevice());
    TestKernels().InferenceHalve(recorder, size, ToBuffer(fine), coarse);
    recorder.Submit();
    ExpectNear(FirstOf<Texel>(coarse, size.Halved().num_pixels()),
               reference::InferenceHalve(size, fine));
  }
}

TEST(InferenceExpand, EqualsReference) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSmallSizes) {
    const InferenceMap coarse = RandomMap(size.Halved(), true, random);
    const InferenceMap data = RandomMap(size, false, random);
    const Buffer state = MakeBuffer<Texel>(size.num_pixels());
    Recorder recorder(TestDevice());
    TestKernels().InferenceExpand(recorder, size.Halved(), size, ToBuffer(coarse), ToBuffer(data),
                                  state);
    recorder.Submit();
    ExpectNear(FirstOf<Texel>(state, size.num_pixels()),
               reference::InferenceExpand(size.Halved(), size, coarse, data));
  }
}

TEST(InferenceRelax, EqualsReference) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSmallSizes) {
    const InferenceMap data = RandomMap(size, false, random);
    const InferenceMap before = RandomMap(size, true, random);
    const Buffer after = MakeBuffer<Texel>(size.num_pixels());
    Recorder recorder(TestDevice());
    TestKernels().InferenceRelax(recorder, size, 0.01F, ToBuffer(data), ToBuffer(before), after);
    recorder.Submit();
    ExpectNear(FirstOf<Texel>(after, size.num_pixels()),
               reference::InferenceRelax(size, 0.01F, data, before));
  }
}

std::vector<float> InverseOf(const std::vector<float>& depth) {
  std::vector<float> inverse;
  for (const float z : depth) inverse.push_back(z > 0 ? 1 / z : 0);
  return inverse;
}

cv::Mat MapOf(const std::vector<float>& values, LevelSize size) {
  return cv::Mat(values, true).reshape(1, static_cast<int>(size.height_px));
}

void ExpectStageEqualsReference(bool with_bounds, std::size_t min_per_inferred,
                                std::mt19937& random) {
  for (const LevelSize size : kSmallSizes) {
    for (const std::uint32_t level : {0u, 1u}) {
      const LevelSize of_winners = level == 0 ? size : size.Halved();
      const std::size_t n = size.num_pixels();
      const InferenceParams params{
          size.width_px, size.height_px, of_winners.width_px, level, 0.1F, 3, 2, 1};
      SourceProjections projections = SourcesToTheRight(4);
      if (with_bounds) SetBounds(size, projections);
      const auto depth = RandomValues(n, 0.5F, 2, 0.5, random);
      auto winners = RandomValues(of_winners.num_pixels(), 0.5F, 2, 0.2, random);
      for (std::size_t i = 0; i < winners.size(); i += 2) winners[i] = -winners[i];
      const InferenceMap state = RandomMap(size.Halved(), true, random);
      const cv::Mat grey = RandomImage(size, random);
      const InferenceMap cells = RandomCells(size, random);
      const Buffer inverse_depth = ToBuffer(InverseOf(depth));
      const Buffer confidence = ToBuffer(std::vector<float>(n, 0));
      const auto tiles = TilesWithoutDepth(MapOf(depth, size));
      if (tiles.empty()) continue;  // of one pixel, which has depth
      Recorder recorder(TestDevice());
      TestKernels().Inference(
          recorder, projections.size(), params, {ToBuffer(WordsOfTiles(tiles)), tiles.size()},
          ToBuffer(depth), ToBuffer(winners), ToBuffer(state), ImagesToBuffer({grey}),
          ToBuffer(cells), ToBuffer(Pack(projections, size)), {inverse_depth, confidence});
      recorder.Submit();
      const auto expected =
          reference::Inference(params, depth, winners, state, grey, cells, projections);
      const auto found = FirstOf<float>(inverse_depth, n);
      const auto found_confidence = FirstOf<float>(confidence, n);
      std::size_t num_inferred = 0;
      for (std::size_t i = 0; i < n; ++i) {
        ASSERT_NEAR(found[i], expected.inverse_depth[i], kRelative * 3);
        ASSERT_NEAR(found_confidence[i], expected.confidence[i], kRelative);
        num_inferred += expected.confidence[i] > 0 ? 1 : 0;
      }
      EXPECT_TRUE(n == 1 || num_inferred > n / min_per_inferred);
    }
  }
}

TEST(InferenceStage, EqualsReference) {
  std::mt19937 random = SeededByTestName();
  ExpectStageEqualsReference(false, 20, random);
}

TEST(InferenceStage, EqualsReferenceWithImagesThatShowAPart) {
  std::mt19937 random = SeededByTestName();
  ExpectStageEqualsReference(true, 50, random);
}

// Rounding of the normals, where the kernel's code differs a little.
constexpr float kNormalTolerance = 1e-5F;

TEST(InferenceNormals, AreThoseOfTheWholeMapInTheTiles) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : {LevelSize{70, 9}, LevelSize{96, 40}}) {
    const std::size_t n = size.num_pixels();
    const auto inverse_depth = RandomValues(n, 1, 1.05F, 0.1, random);
    const NormalsParams params{size.width_px, size.height_px, 80, 80, 35, 20, 0.02F};
    std::vector<std::uint32_t> tiles = {0, 2};
    const Buffer whole = MakeBuffer<float>(3 * n);
    const Buffer in_tiles = ToBuffer(std::vector<float>(3 * n, 2));
    Recorder recorder(TestDevice());
    TestKernels().Normals(recorder, params, ToBuffer(inverse_depth), whole);
    TestKernels().InferenceNormals(recorder, params, {ToBuffer(WordsOfTiles(tiles)), tiles.size()},
                                   ToBuffer(inverse_depth), in_tiles);
    recorder.Submit();
    const auto expected = FirstOf<float>(whole, 3 * n);
    const auto found = FirstOf<float>(in_tiles, 3 * n);
    const cv::Size map(static_cast<int>(size.width_px), static_cast<int>(size.height_px));
    for (std::size_t i = 0; i < 3 * n; ++i) {
      const cv::Point pixel(static_cast<int>(i / 3) % map.width,
                            static_cast<int>(i / 3) / map.width);
      const bool is_in_tile = std::any_of(tiles.begin(), tiles.end(), [&](std::uint32_t tile) {
        return PixelsOfTile(tile, map).contains(pixel);
      });
      ASSERT_NEAR(found[i], is_in_tile ? expected[i] : 2, kNormalTolerance) << i;
    }
  }
}

TEST(InferenceTiles, AreThoseWithAPixelWithoutDepth) {
  cv::Mat depth(17, 70, CV_32FC1, cv::Scalar(1));
  EXPECT_TRUE(TilesWithoutDepth(depth).empty());
  depth.at<float>(7, 31) = 0;
  depth.at<float>(16, 69) = 0;
  EXPECT_EQ(TilesWithoutDepth(depth), (std::vector<std::uint32_t>{0, 8}));
  EXPECT_EQ(PixelsOfTile(8, depth.size()), cv::Rect(64, 16, 6, 1));
}

TEST(InferenceTiles, FillTheirGrid) {
  const std::vector<std::uint32_t> tiles(kMaxTilesInARow + 1, 5);
  const auto [columns, rows] = GridOfTiles(tiles.size());
  const auto words = WordsOfTiles(tiles);
  EXPECT_GE(std::size_t{columns} * rows, tiles.size());
  ASSERT_EQ(words.size(), std::size_t{columns} * rows);
  EXPECT_EQ(words[kMaxTilesInARow], 5U);
  EXPECT_GT(words.back(), 1U << 20);  // none that a map has
}

constexpr LevelSize kSize{90, 61};

// The inverse depth of a plane, with a hole of 20x20 pixels.
std::vector<float> PlaneWithAHole(std::vector<float>& plane) {
  std::vector<float> matched;
  for (int y = 0; y < 61; ++y) {
    for (int x = 0; x < 90; ++x) {
      plane.push_back(1 + 0.004F * float(x) - 0.002F * float(y));
      matched.push_back(std::abs(x - 45) < 10 && std::abs(y - 30) < 10 ? 0 : plane.back());
    }
  }
  return matched;
}

// Inverse depth and confidence, with winners that are farther by so much.
std::pair<std::vector<float>, std::vector<float>> InferPlane(const cv::Mat& cells,
                                                             float winners_off = 0) {
  std::vector<float> plane;
  const std::vector<float> matched = PlaneWithAHole(plane);
  std::vector<float> depth;
  for (const float w : matched) depth.push_back(w > 0 ? 1 / w : 0);
  const std::vector<float> confidence(matched.size(), 0.5F);
  const cv::Mat grey(61, 90, CV_8UC1, cv::Scalar(100));
  const cv::Mat halved(31, 45, CV_8UC1, cv::Scalar(100));
  Inference inference(TestDevice(), TestKernels(), {});
  Recorder recorder(TestDevice());
  const Buffer images = ImagesToBuffer({grey});
  const Buffer of_half_size = ImagesToBuffer({halved});
  const Buffer inverse_depth_buffer = ToBuffer(matched);
  const Buffer confidence_buffer = ToBuffer(confidence);
  const Buffer depth_buffer = ToBuffer(depth);
  std::vector<float> off;
  for (const float w : plane) off.push_back(w - winners_off);
  const Buffer winners = ToBuffer(off);
  const auto tiles = TilesWithoutDepth(MapOf(depth, kSize));
  inference.Record(recorder, {.size = kSize,
                              .images = images,
                              .halved = of_half_size,
                              .matched = {inverse_depth_buffer, confidence_buffer},
                              .depth = depth_buffer,
                              .winners = winners,
                              .winner_size = kSize,
                              .winner_level = 0,
                              .step = 0.02,
                              .projections = SourcesToTheRight(4),
                              .min_views = 2,
                              .min_coarse_views = 1,
                              .cells = cells,
                              .tiles = tiles,
                              .normals = {kSize.width_px, kSize.height_px, 80, 80, 45, 30, 0.02F}});
  recorder.Submit();
  return {FirstOf<float>(inference.inverse_depth(), plane.size()),
          FirstOf<float>(inference.confidence(), plane.size())};
}

TEST(Inference, CompletesAPlane) {
  std::vector<float> plane;
  const std::vector<float> matched = PlaneWithAHole(plane);
  const auto [found, confidence] = InferPlane(cv::Mat::zeros(16, 23, CV_32FC4));
  for (std::size_t i = 0; i < plane.size(); ++i) {
    ASSERT_NEAR(found[i], plane[i], 0.01F) << i;  // half a plane of the sweep
    ASSERT_EQ(confidence[i] > 0, matched[i] == 0) << i;
    ASSERT_LE(confidence[i], 0.125F);
  }
}

// The hole of PlaneWithAHole, and what was matched around it.
const cv::Rect kHoleCells(8, 4, 8, 8);

TEST(Inference, LeavesTheSkyAlone) {
  cv::Mat cells = cv::Mat::zeros(16, 23, CV_32FC4);
  cells(kHoleCells).setTo(cv::Scalar(0, 0, 0, -1));
  const auto [found, confidence] = InferPlane(cells);
  std::vector<float> plane;
  const std::vector<float> matched = PlaneWithAHole(plane);
  for (std::size_t i = 0; i < plane.size(); ++i) {
    ASSERT_EQ(confidence[i], 0);
    ASSERT_EQ(found[i] > 0, matched[i] > 0);
  }
}

TEST(Inference, BelievesAPlaneWhateverItsWinnersAre) {
  const float four_planes = 0.08F;
  const auto num_inferred = [&](float cell_confidence) {
    cv::Mat cells = cv::Mat::zeros(16, 23, CV_32FC4);
    for (int y = kHoleCells.y; y < kHoleCells.br().y; ++y) {
      for (int x = kHoleCells.x; x < kHoleCells.br().x; ++x) {
        const float at_middle = 1 + 0.004F * (4 * float(x) + 1.5F) - 0.002F * (4 * float(y) + 1.5F);
        cells.at<cv::Vec4f>(y, x) = {at_middle, 0.004F, -0.002F, cell_confidence};
      }
    }
    const auto [found, confidence] = InferPlane(cells, four_planes);
    return std::count_if(confidence.begin(), confidence.end(), [](float c) { return c > 0; });
  };
  EXPECT_EQ(num_inferred(0.1F), 0);
  EXPECT_EQ(num_inferred(1.1F), 19 * 19);
}

// Blue above, a textured wall below.
cv::Mat SkyAboveWall(std::mt19937& random) {
  cv::Mat image(96, 160, CV_8UC3, cv::Scalar(220, 190, 170));
  cv::Mat wall = image(cv::Rect(0, 40, 160, 56));
  for (int y = 0; y < wall.rows; ++y) {
    for (int x = 0; x < wall.cols; ++x) {
      wall.at<cv::Vec3b>(y, x) = cv::Vec3b::all(static_cast<std::uint8_t>(40 + random() % 60));
    }
  }
  return image;
}

TEST(FindSky, FindsItAboveAWall) {
  std::mt19937 random = SeededByTestName();
  const cv::Mat sky = FindSky(SkyAboveWall(random), cv::Mat::zeros(96, 160, CV_32FC1));
  ASSERT_EQ(sky.size(), cv::Size(40, 24));
  EXPECT_EQ(cv::countNonZero(sky.rowRange(0, 10)), 10 * 40);
  EXPECT_EQ(cv::countNonZero(sky.rowRange(13, 24)), 0);
}

TEST(FindSky, FindsNoneWhereDepthWasMatched) {
  std::mt19937 random = SeededByTestName();
  cv::Mat depth = cv::Mat::zeros(96, 160, CV_32FC1);
  depth.colRange(0, 80).setTo(3);
  EXPECT_EQ(cv::countNonZero(FindSky(SkyAboveWall(random), depth)), 0);
}

// A bare bright roof up to the border of the image, with a rib across it and a textured floor
// below.
TEST(FindSky, FindsNoneOnARoofSeenFromAbove) {
  cv::Mat image(96, 160, CV_8UC3, cv::Scalar::all(170));
  cv::Mat depth = cv::Mat::zeros(96, 160, CV_32FC1);
  const auto rib = [&](const cv::Rect& where, float depth_su) {
    image(where).setTo(cv::Scalar::all(60));
    depth(where).setTo(depth_su);
  };
  rib({0, 12, 140, 8}, 9);
  rib({0, 48, 140, 8}, 7);
  rib({0, 88, 160, 8}, 5);
  EXPECT_EQ(cv::countNonZero(FindSky(image, depth)), 0);
  // Seen past what hangs into the view, above a far skyline, it is the sky.
  depth.setTo(0);
  rib({0, 12, 140, 8}, 5);
  rib({0, 48, 140, 8}, 5);
  rib({0, 88, 160, 8}, 90);
  EXPECT_GT(cv::countNonZero(FindSky(image, depth)), 500);
}

// Indoors: a bare grey wall up to the border, beside what is brighter.
TEST(FindSky, FindsNoneOnAWallThatIsDarkerThanWhatWasMatched) {
  std::mt19937 random = SeededByTestName();
  cv::Mat image = SkyAboveWall(random);
  cv::Mat depth = cv::Mat::zeros(96, 160, CV_32FC1);
  depth.rowRange(40, 96).setTo(3);
  cv::Mat above = image.rowRange(0, 40);
  cv::Mat bright = image(cv::Rect(0, 56, 20, 40));  // a tenth of what was matched
  bright.setTo(cv::Scalar::all(250));
  above.setTo(cv::Scalar(152, 150, 150));
  EXPECT_EQ(cv::countNonZero(FindSky(image, depth)), 0);
  // What is lit is never brighter than a sky without sun.
  bright.setTo(cv::Scalar::all(140));
  EXPECT_GT(cv::countNonZero(FindSky(image, depth)), 0);
  // Under a blue sky there is sun.
  bright.setTo(cv::Scalar::all(250));
  above.setTo(cv::Scalar(180, 150, 120));
  EXPECT_GT(cv::countNonZero(FindSky(image, depth)), 0);
}

TEST(FindSky, FindsNoneBelowOrInWarmOrDarkColours) {
  std::mt19937 random = SeededByTestName();
  const cv::Mat none = cv::Mat::zeros(96, 160, CV_32FC1);
  cv::Mat turned;
  cv::flip(SkyAboveWall(random), turned, 0);
  EXPECT_EQ(cv::countNonZero(FindSky(turned, none)), 0);
  for (const cv::Scalar& colour : {cv::Scalar(170, 190, 220), cv::Scalar(90, 80, 70)}) {
    cv::Mat image = SkyAboveWall(random);
    image.rowRange(0, 40).setTo(colour);
    EXPECT_EQ(cv::countNonZero(FindSky(image, none)), 0);
  }
}

}  // namespace
}  // namespace mono3d
