// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/browser.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <thread>

#include "drawing/model_picture.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/ply_file.h"
#include "view/live_view.h"
#include "view/model_blocks.h"
#include "view/ply_vertices.h"
#include "view/run_folder.h"
#include "view/small_picture.h"
#include "view/view_server.h"

namespace mono3d::tools {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;

// A coloured bowl before the camera at the origin, `num` x `num` surfels.
PointCloud Bowl(int num) {
  PointCloud cloud;
  for (int i = 0; i < num; ++i) {
    for (int k = 0; k < num; ++k) {
      const float x = 4.0F * static_cast<float>(i) / static_cast<float>(num) - 2;
      const float y = 3.0F * static_cast<float>(k) / static_cast<float>(num) - 1.5F;
      cloud.points.emplace_back(x, y, 5 - 0.2F * (x * x + y * y));
      cloud.normals.push_back(Eigen::Vector3f(-0.4F * x, -0.4F * y, -1).normalized());
      cloud.radii.push_back(3.0F / static_cast<float>(num));
      const auto light = [](float v) { return static_cast<std::uint8_t>(120 + 60 * v); };
      cloud.colours.push_back({light(x), light(y), light(std::sin(3 * x) * std::cos(3 * y))});
      cloud.confidences.push_back(0.9F);
      cloud.observations.push_back(3);
    }
  }
  return cloud;
}

CameraModel SeeingCamera() {
  CameraModel camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = 520;
  camera.fy = 540;
  camera.cx = 300;
  camera.cy = 250;
  return camera;
}

ViewArguments FreePort() { return {}; }

const char* const kHasAll = "window.mono3d !== undefined && mono3d.state().complete";
// The whole window shows the model alone.
const char* const kBare =
    "document.querySelectorAll('section, #menu').forEach((e) => e.style.display = 'none')";

// Until what was asked for is drawn, however long a picture takes.
const char* const kDrawn =
    "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => "
    "requestAnimationFrame(done))))";

class ViewInBrowser : public TemporaryFolderTest {};

TEST_F(ViewInBrowser, DrawsTheSurfelsAsTheRendererDoes) {
  const PointCloud cloud = Bowl(150);
  const CameraModel camera = SeeingCamera();
  ViewStore store;
  SurfelBlock block = MakeSurfelBlock(ToViewSurfels(cloud));
  // Elsewhere, and with another unit: the page moves it back.
  const Similarity S(0.5, Pose(RotationExp({0.2, -0.3, 0.4}), {1, 2, 3}));
  PointCloud moved = cloud;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    moved.points[i] = (S.Inverse() * cloud.points[i].cast<double>()).cast<float>();
    moved.normals[i] =
        (S.Inverse().pose().rotation() * cloud.normals[i].cast<double>()).cast<float>();
    moved.radii[i] = cloud.radii[i] / 0.5F;
  }
  block = MakeSurfelBlock(ToViewSurfels(moved));
  block.S_world_block = S;
  store.SetModel({0}, {block});
  store.SetCamera(camera);
  store.SetStatus({{"phase", "file"}});
  const ViewServer server(FreePort(), store);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(server.url());
  ASSERT_TRUE(browser.WaitFor(kHasAll)) << browser.errors();
  browser.Evaluate(kBare);
  browser.Evaluate(
      "mono3d.lookFrom([0.2, -0.1, 0.3, 0, 0, 0, 1],"
      "{fx: 520, fy: 540, cx: 300, cy: 250, width: 640, height: 480})");
  browser.Evaluate("new Promise((done) => setTimeout(done, 300))");
  ASSERT_TRUE(browser.WaitFor("mono3d.state().drawn === 22500"));
  const cv::Mat seen = browser.Screenshot();
  const Pose T_world_cam(Eigen::Quaterniond::Identity(), {0.2, -0.1, 0.3});
  const cv::Mat expected = ToPicture(RenderModel(cloud, camera, T_world_cam), ModelAspect::kColour);
  ASSERT_EQ(seen.size(), expected.size());
  cv::Mat difference, worst;
  cv::absdiff(seen, expected, difference);
  std::vector<cv::Mat> channels;
  cv::split(difference, channels);
  worst = cv::max(cv::max(channels[0], channels[1]), channels[2]);
  cv::Mat shown;
  cv::inRange(expected, cv::Scalar(255, 255, 255), cv::Scalar(255, 255, 255), shown);
  EXPECT_LT(cv::countNonZero(shown), kWidth * kHeight / 2) << "the model is not in the picture";
  // Of overlapping discs another one may be in front, and at borders a pixel is in or out.
  EXPECT_LT(cv::countNonZero(worst > 12), kWidth * kHeight / 200);
  EXPECT_LT(cv::mean(worst)[0], 2);
  EXPECT_EQ(browser.errors(), "");
}

// A run whose model grows by a strip at a time.
class GrowingRun {
 public:
  std::atomic<int> num_strips = 1;
  std::shared_ptr<const PlaceOfMap> place;

  PipelineSnapshot Snapshot(std::uint64_t since) const {
    PipelineSnapshot snapshot;
    const int num = num_strips;
    snapshot.frame_index = 20 * num;  // every second one is left out
    snapshot.status = TrackingStatus::kTracking;
    snapshot.num_surfels = 900 * num;
    snapshot.counts.num_frames = 10 * num;
    std::vector<KeyframePose> poses;
    snapshot.surfels.version = static_cast<std::uint64_t>(num);
    for (int i = 0; i < num; ++i) {
      SurfelAnchor anchor;
      anchor.number = static_cast<std::uint32_t>(i);
      anchor.frame_index = 10 * i;
      anchor.S_world_anchor = Similarity(1, Pose(Eigen::Quaterniond::Identity(), {4.0 * i, 0, 0}));
      snapshot.surfels.anchors.push_back(anchor);
      poses.push_back({.keyframe_id = i, .S_world_kf = anchor.S_world_anchor});
      if (static_cast<std::uint64_t>(i) < since) continue;
      snapshot.surfels.changed.push_back(
          {anchor.number, std::make_shared<const PointCloud>(Bowl(30))});
    }
    snapshot.keyframe_poses = std::make_shared<const KeyframePoses>(num, std::move(poses));
    snapshot.model_poses = snapshot.keyframe_poses;
    snapshot.place = place;
    return snapshot;
  }
};

// As soon as positions tell how large a unit of the model is.
TEST_F(ViewInBrowser, MeasuresARunInMetres) {
  PlaceOfMap place;
  place.georeference.S_enu_map = Similarity(20, Pose());
  place.georeference.scale_sigma = 0.01;
  place.georeference.heading_sigma_rad = 0.01;
  place.georeference.position_sigma_m = {3, 4, 5};
  GrowingRun run;
  run.place = std::make_shared<const PlaceOfMap>(place);
  LiveView view(FreePort());
  view.Begin([&run](std::uint64_t since) { return run.Snapshot(since); }, 100);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(view.url());
  ASSERT_TRUE(browser.WaitFor(kHasAll)) << browser.errors();
  const auto text_of = [&](const std::string& id) {
    return browser.Evaluate("document.getElementById('" + id + "').textContent").get<std::string>();
  };
  for (const char* row : {"Scale± 1.0 %", "North± 0.57°", "Place± 5.0 m"}) {
    EXPECT_THAT(text_of("numbers"), testing::HasSubstr(row));
  }
  browser.Evaluate("document.getElementById('measure').click()");
  browser.Evaluate("mono3d.measure([0, 0, 0], [0, 0.5, 0])");
  EXPECT_EQ(text_of("distance"), "10.00 m ± 0.10 m by the scale");
  EXPECT_EQ(browser.errors(), "");
}

TEST_F(ViewInBrowser, ShowsAModelThatGrows) {
  GrowingRun run;
  auto view = std::make_unique<LiveView>(FreePort());
  view->Begin([&run](std::uint64_t since) { return run.Snapshot(since); }, 100);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(view->url());
  ASSERT_TRUE(browser.WaitFor(std::string(kHasAll) + " && mono3d.state().surfels === 900"))
      << browser.errors();
  run.num_strips = 3;
  EXPECT_TRUE(browser.WaitFor("mono3d.state().loaded === 2700 && mono3d.state().drawn > 900"));
  EXPECT_EQ(browser.Evaluate("mono3d.state().keyframes"), 3);
  EXPECT_EQ(browser.Evaluate("document.getElementById('headline').textContent"),
            "Running: frame 30 of 100");
  // The whole model is on the screen.
  browser.Evaluate(kBare);
  cv::Mat blank;
  cv::inRange(browser.Screenshot(), cv::Scalar(255, 255, 255), cv::Scalar(255, 255, 255), blank);
  EXPECT_LT(cv::countNonZero(blank), kWidth * kHeight * 95 / 100);

  browser.Reload();
  EXPECT_TRUE(browser.WaitFor(std::string(kHasAll) + " && mono3d.state().loaded === 2700"));

  view->End();
  EXPECT_TRUE(browser.WaitFor("mono3d.state().phase === 'finished'"));
  view.reset();
  EXPECT_TRUE(browser.WaitFor("!mono3d.state().connected"));
  EXPECT_EQ(browser.Evaluate("mono3d.state().loaded"), 2700) << "what was seen stays";
  EXPECT_EQ(browser.Evaluate("document.getElementById('headline').textContent"),
            "The run has ended, or cannot be reached");
  EXPECT_EQ(browser.errors(), "");
}

TEST_F(ViewInBrowser, ShowsEverythingAfterASleep) {
  GrowingRun run;
  LiveView view(FreePort());
  view.Begin([&run](std::uint64_t since) { return run.Snapshot(since); }, 100);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(view.url());
  ASSERT_TRUE(browser.WaitFor(std::string(kHasAll) + " && mono3d.state().loaded === 900"))
      << browser.errors();
  browser.PutToSleep();
  run.num_strips = 4;
  // Longer than the page waits for its next question.
  std::this_thread::sleep_for(std::chrono::milliseconds(2500));
  EXPECT_EQ(browser.Evaluate("mono3d.state().loaded"), 900) << "it has not slept";
  view.End();
  browser.WakeUp();
  EXPECT_TRUE(browser.WaitFor("mono3d.state().loaded === 3600 && mono3d.state().drawn > 900"));
  EXPECT_TRUE(browser.WaitFor("mono3d.state().phase === 'finished'"));
  EXPECT_EQ(browser.Evaluate("mono3d.state().keyframes"), 4);
  EXPECT_EQ(browser.errors(), "");
}

// The page of a run that has ended is left open, and another run takes its place.
TEST_F(ViewInBrowser, ShowsTheNextRunAtTheSameAddress) {
  GrowingRun run;
  run.num_strips = 3;
  ViewArguments same;
  {
    // Not the usual port, which the next program that looks for one would take.
    HttpServerOptions any;
    any.port = 0;
    same.port = HttpServer(any, {}).port();
  }
  auto view = std::make_unique<LiveView>(same);
  view->Begin([&run](std::uint64_t since) { return run.Snapshot(since); }, 100);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(view->url());
  ASSERT_TRUE(browser.WaitFor(std::string(kHasAll) + " && mono3d.state().loaded === 2700"))
      << browser.errors();
  view.reset();
  ASSERT_TRUE(browser.WaitFor("!mono3d.state().connected"));
  GrowingRun next_run;
  LiveView next_view(same);
  next_view.Begin([&](std::uint64_t since) { return next_run.Snapshot(since); }, 100);
  EXPECT_TRUE(browser.WaitFor("mono3d.state().connected && mono3d.state().loaded === 900"));
  EXPECT_EQ(browser.Evaluate("mono3d.state().keyframes"), 1);
  EXPECT_EQ(browser.errors(), "");
}

TEST_F(ViewInBrowser, ShowsWhereToFlyNext) {
  ViewStore store;
  store.SetModel({0}, {MakeSurfelBlock(ToViewSurfels(Bowl(50)))});
  store.SetStatus({{"phase", "file"}});
  store.SetUp({0, -1, 0});
  ViewProposal proposal;
  proposal.T_world_cam = Pose(Eigen::Quaterniond::Identity(), {0, 0, 2});
  proposal.target_world = {0, 0, 5};
  proposal.reason = "thin: <b>one</b> depth map";
  proposal.gain_share = 0.1234;
  store.SetNextViews({proposal, proposal});
  const ViewServer server(FreePort(), store);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(server.url());
  ASSERT_TRUE(browser.WaitFor(kHasAll)) << browser.errors();
  EXPECT_EQ(browser.Evaluate("mono3d.state().nextViews"), 0) << "only where it is asked for";
  const cv::Mat without = browser.Screenshot();
  browser.Evaluate("document.getElementById('show-next').click()");
  EXPECT_TRUE(browser.WaitFor("mono3d.state().nextViews === 2"));
  EXPECT_EQ(browser.Evaluate("document.querySelector('#next-list li').textContent"),
            "thin: <b>one</b> depth map (12 %)");
  EXPECT_EQ(browser.Evaluate("document.querySelectorAll('#next-labels span').length"), 2);
  browser.Evaluate("new Promise((done) => setTimeout(done, 300))");
  // The colour of the arrows.
  const auto num_purple = [](const cv::Mat& picture) {
    cv::Mat purple;
    cv::inRange(picture, cv::Scalar(150, 20, 140), cv::Scalar(170, 40, 160), purple);
    return cv::countNonZero(purple);
  };
  EXPECT_LT(num_purple(without), 20);
  EXPECT_GT(num_purple(browser.Screenshot()), 100);
  browser.Evaluate("document.querySelector('#next-list button').click()");
  browser.Evaluate("new Promise((done) => setTimeout(done, 900))");
  EXPECT_EQ(browser.errors(), "");
}

TEST_F(ViewInBrowser, MeasuresWhatIsClickedOn) {
  ViewStore store;
  PointCloud wall;
  for (int i = 0; i < 10000; ++i) {
    wall.points.emplace_back(0.04F * static_cast<float>(i % 100) - 2,
                             0.04F * static_cast<float>(i / 100) - 2, 5.0F);
    wall.normals.emplace_back(0, 0, -1);
    wall.radii.push_back(0.04F);
  }
  store.SetModel({0}, {MakeSurfelBlock(ToViewSurfels(wall))});
  store.SetStatus({{"phase", "file"}});
  const ViewServer server(FreePort(), store);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(server.url());
  ASSERT_TRUE(browser.WaitFor(kHasAll)) << browser.errors();
  // 100 px are 1 unit on the wall.
  browser.Evaluate(
      "mono3d.lookFrom([0, 0, 0, 0, 0, 0, 1],"
      "{fx: 500, fy: 500, cx: 319.5, cy: 239.5, width: 640, height: 480})");
  browser.Evaluate(kDrawn);
  browser.Evaluate("document.getElementById('measure').click()");
  browser.Evaluate("mono3d.click(200, 240)");
  browser.Evaluate("mono3d.click(350, 240)");
  EXPECT_NEAR(browser.Evaluate("mono3d.state().distance").get<double>(), 1.5, 0.1);
  EXPECT_TRUE(browser.Evaluate("mono3d.pick(20, 20) === null").get<bool>());
  EXPECT_EQ(browser.errors(), "");
}

// A wall, 4 units wide and high, 5 before the camera at the origin: 100 px are 1 unit. Its left
// half and its right half are blocks of their own, of which all else but the colour differs.
void ShowTwoHalves(ViewStore& store) {
  std::vector<SurfelBlock> blocks;
  for (const bool is_right : {false, true}) {
    std::vector<ViewSurfel> half;
    for (int i = 0; i < 5000; ++i) {
      ViewSurfel surfel;
      const float x = 0.04F * static_cast<float>(i % 50) + (is_right ? 0.02F : -1.98F);
      surfel.point = {x, 0.04F * static_cast<float>(i / 50) - 2, 5};
      surfel.normal = {0, 0, -1};
      surfel.radius = 0.04F;
      surfel.confidence = is_right ? 1.0F : 0.0F;
      surfel.observations = is_right ? 31 : 1;
      surfel.error = is_right ? 1.0F : 0.0F;
      surfel.first_frame = is_right ? 310 : 10;
      half.push_back(surfel);
    }
    blocks.push_back(MakeSurfelBlock(std::move(half)));
    blocks.back().id = is_right ? 1 : 0;
  }
  store.SetModel({0, 1}, std::move(blocks));
  store.SetUp({0, -1, 0});
  store.SetStatus({{"phase", "file"}});
}

const char* const kBeforeTheWall =
    "mono3d.lookFrom([0, 0, 0, 0, 0, 0, 1],"
    "{fx: 500, fy: 500, cx: 319.5, cy: 239.5, width: 640, height: 480})";
const cv::Point kLeft(220, 240), kRight(420, 240), kTop(320, 80), kBottom(320, 400);

// Red, green and blue there.
cv::Vec3b ColourAt(const cv::Mat& picture, cv::Point at) {
  const auto bgr = picture.at<cv::Vec3b>(at);
  return {bgr[2], bgr[1], bgr[0]};
}
// The colours of a scale begin with black and blue and end with red.
bool IsLow(const cv::Vec3b& rgb) { return rgb[0] < 100; }
bool IsHigh(const cv::Vec3b& rgb) { return rgb[0] > 120 && rgb[0] > rgb[2] + 50; }

TEST_F(ViewInBrowser, ColoursTheModelByWhatIsAskedFor) {
  ViewStore store;
  ShowTwoHalves(store);
  const ViewServer server(FreePort(), store);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(server.url());
  ASSERT_TRUE(browser.WaitFor(kHasAll)) << browser.errors();
  browser.Evaluate(kBare);
  browser.Evaluate(kBeforeTheWall);
  const auto picture_by = [&](const std::string& value) {
    browser.Evaluate("(() => { const colour = document.getElementById('colour'); colour.value = '" +
                     value + "'; colour.dispatchEvent(new Event('change')); })()");
    browser.Evaluate(kDrawn);
    return browser.Screenshot();
  };
  EXPECT_EQ(ColourAt(picture_by("0"), kLeft), cv::Vec3b(200, 200, 200)) << "as seen";
  for (const char* value : {"1", "4", "5"}) {  // confidence, time, observations
    const cv::Mat picture = picture_by(value);
    EXPECT_TRUE(IsLow(ColourAt(picture, kLeft))) << value << ColourAt(picture, kLeft);
    EXPECT_TRUE(IsHigh(ColourAt(picture, kRight))) << value << ColourAt(picture, kRight);
  }
  (void)picture_by("4");
  const auto legend = [&](const char* end) {
    return browser.Evaluate("document.getElementById('legend-" + std::string(end) +
                            "').textContent");
  };
  EXPECT_EQ(legend("low"), "frame 10");
  EXPECT_EQ(legend("high"), "frame 310");
  store.SetTimes({0, 5}, {600, 25});
  ASSERT_TRUE(browser.WaitFor("document.getElementById('legend-low').textContent !== 'frame 10'"));
  EXPECT_EQ(legend("low"), "frame 10 (5.3 s)");
  EXPECT_EQ(legend("high"), "frame 310 (15.3 s)");
  const cv::Vec3b normal = ColourAt(picture_by("2"), kRight);
  EXPECT_NEAR(normal[0], 128, 3);
  EXPECT_NEAR(normal[1], 128, 3);
  EXPECT_NEAR(normal[2], 0, 3) << "it faces -z";
  const cv::Mat height = picture_by("3");
  EXPECT_TRUE(IsHigh(ColourAt(height, kTop))) << ColourAt(height, kTop);
  EXPECT_TRUE(IsLow(ColourAt(height, kBottom))) << ColourAt(height, kBottom);
  EXPECT_EQ(browser.Evaluate("document.getElementById('colour-error').disabled"), true);
  store.SetErrors(0.25);
  ASSERT_TRUE(browser.WaitFor("!document.getElementById('colour-error').disabled"));
  const cv::Mat error = picture_by("6");
  EXPECT_TRUE(IsLow(ColourAt(error, kLeft))) << ColourAt(error, kLeft);
  EXPECT_TRUE(IsHigh(ColourAt(error, kRight))) << ColourAt(error, kRight);
  EXPECT_EQ(browser.Evaluate("document.getElementById('legend-high').textContent"),
            "0.25 m or more");
  EXPECT_EQ(browser.errors(), "");
}

// The surfels of a block were seen at different times.
TEST_F(ViewInBrowser, ColoursAFinishedRunByTheTimeOfEachSurfel) {
  constexpr int kSide = 100;
  PointCloud wall;  // 4 units wide and high; its left half was seen at once, its right half later
  for (int i = 0; i < kSide * kSide; ++i) {
    wall.points.emplace_back(0.04F * static_cast<float>(i % kSide) - 2,
                             0.04F * static_cast<float>(i / kSide) - 2, 5.0F);
    wall.normals.emplace_back(0, 0, -1);
    wall.radii.push_back(0.04F);
    wall.first_frames.push_back(i % kSide < kSide / 2 ? 7 : 4007);
  }
  WritePly(folder_ / "model.ply", wall);
  WriteText("run.json", R"({"maps": [{"model_frames":
      {"first": 7, "first_s": 0.25, "last": 4007, "last_s": 130.5}}]})");
  const auto show = [](const std::filesystem::path& run, ViewStore& store) {
    const RunFolder folder(run);
    const PlyVertices vertices(folder.model_path());
    store.SetModel({0}, ModelBlocks(vertices).All());
    folder.Show(store, vertices.size(), {});
  };
  ViewStore store;
  show(folder_, store);
  const ViewServer server(FreePort(), store);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(server.url());
  ASSERT_TRUE(browser.WaitFor(kHasAll)) << browser.errors();
  EXPECT_EQ(browser.Evaluate("mono3d.state().blocks"), 1);
  EXPECT_EQ(browser.Evaluate("document.getElementById('colour-time').disabled"), false);
  browser.Evaluate(
      "(() => { const colour = document.getElementById('colour'); colour.value = '4';"
      "colour.dispatchEvent(new Event('change')); })()");
  browser.Evaluate(kBeforeTheWall);
  browser.Evaluate(kDrawn);
  EXPECT_EQ(browser.Evaluate("document.getElementById('legend-low').textContent"),
            "frame 7 (0.3 s)");
  EXPECT_EQ(browser.Evaluate("document.getElementById('legend-high').textContent"),
            "frame 4007 (130.5 s)");
  browser.Evaluate(kBare);
  const cv::Mat picture = browser.Screenshot();
  EXPECT_TRUE(IsLow(ColourAt(picture, kLeft))) << ColourAt(picture, kLeft);
  EXPECT_TRUE(IsHigh(ColourAt(picture, kRight))) << ColourAt(picture, kRight);

  // A model of an earlier version does not tell.
  std::filesystem::create_directories(folder_ / "old");
  wall.first_frames.clear();
  WritePly(folder_ / "old" / "model.ply", wall);
  ViewStore old_store;
  show(folder_ / "old", old_store);
  const ViewServer old_server(FreePort(), old_store);
  browser.Open(old_server.url());
  ASSERT_TRUE(browser.WaitFor(kHasAll)) << browser.errors();
  EXPECT_EQ(browser.Evaluate("document.getElementById('colour-time').disabled"), true);
  EXPECT_EQ(browser.Evaluate("document.getElementById('colour-time').textContent"),
            "time first seen (not in this model)");
  EXPECT_EQ(browser.errors(), "");
}

// A level field of 16 x 16 blocks, each a square of side 1 with 10,000 surfels; z is down.
constexpr int kFieldSide = 16, kSurfelsOfSide = 100;

void ShowField(ViewStore& store) {
  std::vector<SurfelBlock> blocks;
  std::vector<std::int64_t> ids;
  for (int number = 0; number < kFieldSide * kFieldSide; ++number) {
    std::vector<ViewSurfel> square(kSurfelsOfSide * kSurfelsOfSide);
    for (std::size_t i = 0; i < square.size(); ++i) {
      const auto x = static_cast<float>(i % kSurfelsOfSide),
                 y = static_cast<float>(i / kSurfelsOfSide);
      square[i].point = {x / kSurfelsOfSide + static_cast<float>(number % kFieldSide),
                         y / kSurfelsOfSide + static_cast<float>(number / kFieldSide), 0};
      square[i].normal = {0, 0, -1};
      square[i].radius = 0.8F / kSurfelsOfSide;
    }
    blocks.push_back(MakeSurfelBlock(std::move(square)));
    blocks.back().id = number;
    ids.push_back(number);
  }
  store.SetModel(ids, std::move(blocks));
  store.SetUp({0, 0, -1});
  store.SetStatus({{"phase", "file"}});
}

// Of a model that is larger than what a window can show, the page asks for what the window can
// show: all of what is near, little of what is far, something of everything; and in few requests.
TEST_F(ViewInBrowser, FetchesOfALargeModelWhatItsWindowCanShow) {
  ViewStore store;
  ShowField(store);
  const ViewServer server(FreePort(), store);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(server.url());
  ASSERT_TRUE(browser.WaitFor(kHasAll)) << browser.errors();
  const auto num_loaded = [&] { return browser.Evaluate("mono3d.state().loaded").get<int>(); };
  constexpr int kNumBlocks = kFieldSide * kFieldSide;
  constexpr int kAll = kNumBlocks * kSurfelsOfSide * kSurfelsOfSide;
  // From afar it is a picture of so many pixels; circles around squares cover them more than once.
  constexpr int kPixels = kWidth * kHeight;
  EXPECT_LT(num_loaded(), 4 * kPixels);
  EXPECT_LT(num_loaded(), kAll / 2);
  EXPECT_EQ(browser.Evaluate("mono3d.blocks().filter(({loaded}) => loaded === 0).length"), 0);
  // Requests of a megabyte each at most, not one for each block.
  const auto num_requests = browser
                                .Evaluate(
                                    "performance.getEntriesByType('resource')"
                                    ".filter(({name}) => name.includes('surfels?')).length")
                                .get<int>();
  EXPECT_LT(num_requests, kNumBlocks / 4);

  // Over the middle of the first block, 0.6 above it: the window shows parts of four blocks.
  browser.Evaluate(
      "mono3d.lookFrom([0.5, 0.5, -0.6, 0, 0, 0, 1],"
      "{fx: 500, fy: 500, cx: 319.5, cy: 239.5, width: 640, height: 480})");
  const int from_afar = num_loaded();
  ASSERT_TRUE(browser.WaitFor(
      "mono3d.state().complete && mono3d.blocks().find(({id}) => id === 0).loaded === 10000"))
      << browser.Evaluate("JSON.stringify(mono3d.blocks().slice(0, 3))");
  browser.Evaluate(kDrawn);
  ASSERT_TRUE(browser.WaitFor("mono3d.state().complete"));
  EXPECT_LT(num_loaded(), from_afar + 9 * kSurfelsOfSide * kSurfelsOfSide) << "more than is near";
  EXPECT_EQ(browser.Evaluate("mono3d.blocks().filter(({loaded}) => loaded === 0).length"), 0);
  EXPECT_EQ(browser.errors(), "");
}

TEST_F(ViewInBrowser, CutsTheModelOpen) {
  ViewStore store;
  ShowTwoHalves(store);
  const ViewServer server(FreePort(), store);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(server.url());
  ASSERT_TRUE(browser.WaitFor(kHasAll)) << browser.errors();
  browser.Evaluate(kBare);
  browser.Evaluate(kBeforeTheWall);
  const auto cut_at = [&](const std::string& name, int value) {
    browser.Evaluate("(() => { const input = document.querySelector('#cuts input[name=\"" + name +
                     "\"]'); input.value = " + std::to_string(value) +
                     "; input.dispatchEvent(new Event('input')); })()");
    browser.Evaluate(kDrawn);
    return browser.Screenshot();
  };
  const cv::Vec3b white(255, 255, 255), wall(200, 200, 200);
  cv::Mat picture = cut_at("across, from", 500);
  EXPECT_EQ(ColourAt(picture, kLeft), white);
  EXPECT_EQ(ColourAt(picture, kRight), wall);
  EXPECT_TRUE(browser.Evaluate("mono3d.pick(220, 240) === null").get<bool>()) << "it is gone";
  picture = cut_at("height, to", 500);
  EXPECT_EQ(ColourAt(picture, {420, 80}), white) << "the upper half";
  EXPECT_EQ(ColourAt(picture, {420, 400}), wall);
  browser.Evaluate("document.getElementById('uncut').click()");
  browser.Evaluate(kDrawn);
  picture = browser.Screenshot();
  EXPECT_EQ(ColourAt(picture, kLeft), wall);
  EXPECT_EQ(ColourAt(picture, kTop), wall);
  EXPECT_EQ(browser.errors(), "");
}

TEST_F(ViewInBrowser, GoesThroughTheFlightWithItsPictures) {
  ViewStore store;
  ShowTwoHalves(store);
  store.SetCamera(SeeingCamera());
  store.SetKeyframes({{.id = 7, .T_world_cam = Pose(Eigen::Quaterniond::Identity(), {-1, 0, 1})},
                      {.id = 9, .T_world_cam = Pose(Eigen::Quaterniond::Identity(), {1, 0.5, 1})}});
  const SharedBytes jpeg = ToJpeg(cv::Mat(30, 40, CV_8UC3, cv::Scalar(0, 0, 255)));
  store.SetPictureOfKeyframe("image", 7, jpeg);
  store.SetPictureOfKeyframe("image", 9, jpeg);
  store.SetPictureOfKeyframe("depth", 9, jpeg);
  const ViewServer server(FreePort(), store);
  Browser browser(folder_, kWidth, kHeight);
  browser.Open(server.url());
  ASSERT_TRUE(browser.WaitFor(kHasAll)) << browser.errors();
  const auto slide_to = [&](int stop) {
    browser.Evaluate("(() => { const slider = document.getElementById('slider'); slider.value = " +
                     std::to_string(stop) + "; slider.dispatchEvent(new Event('input')); })()");
  };
  const auto says = [&](const std::string& id, const std::string& text) {
    return browser.WaitFor("document.getElementById('" + id + "').textContent === '" + text + "'");
  };
  const std::string depth_is_shown = "document.getElementById('depth').offsetHeight > 20";
  slide_to(1);
  EXPECT_TRUE(says("image-caption", "keyframe 2 of 2"));
  EXPECT_TRUE(browser.WaitFor(depth_is_shown));
  slide_to(0);
  EXPECT_TRUE(says("image-caption", "keyframe 1 of 2"));
  EXPECT_TRUE(says("depth-caption", "no depth map of this keyframe"));
  EXPECT_FALSE(browser.Evaluate(depth_is_shown).get<bool>());
  browser.Evaluate("document.getElementById('ride').click()");
  EXPECT_TRUE(
      browser.WaitFor("Math.hypot(mono3d.state().eye[0] + 1, mono3d.state().eye[2] - 1) < 0.01"));
  slide_to(1);
  EXPECT_TRUE(
      browser.WaitFor("Math.hypot(mono3d.state().eye[0] - 1, mono3d.state().eye[1] - 0.5) < 0.01"));
  EXPECT_EQ(browser.errors(), "");
}

TEST_F(ViewInBrowser, FitsAPhone) {
  ViewStore store;
  ShowTwoHalves(store);
  store.SetStatus({{"phase", "running"},
                   {"frame", 12345},
                   {"surfels", 12'345'678},
                   {"tracking", "tracking"},
                   {"health", "degraded"},
                   {"memory_mb", 12345},
                   {"counts",
                    {{"frames", 12345},
                     {"tracked", 12345},
                     {"dropped_frames", 1234},
                     {"keyframes", 1234},
                     {"depth_maps", 1234},
                     {"fused", 1234},
                     {"dropped_bundles", 123}}}});
  const ViewServer server(FreePort(), store);
  constexpr int kPhoneWidth = 390, kPhoneHeight = 844;
  Browser browser(folder_, kPhoneWidth, kPhoneHeight);
  browser.Open(server.url());
  ASSERT_TRUE(browser.WaitFor(kHasAll)) << browser.errors();
  const std::string rectangle = "document.getElementById('panel').getBoundingClientRect()";
  EXPECT_EQ(browser.Evaluate(rectangle + ".width"), 0) << "the panel is folded away";
  EXPECT_EQ(browser.Evaluate("[...document.querySelectorAll('#numbers > *')]"
                             ".filter((e) => e.getBoundingClientRect().height > 20).length"),
            0)
      << "a row takes two lines";
  browser.Evaluate("document.getElementById('menu').click()");
  EXPECT_TRUE(browser.WaitFor(rectangle + ".width > 200"));
  EXPECT_EQ(browser.Evaluate(
                "[...document.querySelectorAll('section, button, select, dd')]"
                ".map((e) => e.getBoundingClientRect())"
                ".filter((r) => r.width > 0 && (r.left < 0 || r.right > innerWidth)).length"),
            0)
      << "something is beside the window";
  EXPECT_EQ(browser.Evaluate("document.documentElement.scrollWidth"), kPhoneWidth);
  EXPECT_EQ(browser.errors(), "");
}

}  // namespace
}  // namespace mono3d::tools
