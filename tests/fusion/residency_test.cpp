// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/residency.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fusion/blocks.h"
#include "fusion/fusion_scene.h"
#include "fusion/model_run.h"
#include "gpu/test_device.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/state_folder.h"
#include "mono3d/fusion/surfel_map.h"

// Where the surfels are makes no difference to what they are: a model of which little may be on the
// device is, in every bit, the one of which all is there.
namespace mono3d {
namespace {

class ResidencyTest : public TemporaryFolderTest {};

// What was logged while it lives.
class LogCapture {
 public:
  LogCapture() {
    SetLogSink(
        [this](LogLevel, std::string_view message) { text_ += std::string(message) + "\n"; });
  }
  ~LogCapture() { SetLogSink({}); }
  LogCapture(const LogCapture&) = delete;
  LogCapture& operator=(const LogCapture&) = delete;

  const std::string& Text() const { return text_; }

 private:
  std::string text_;
};

// Of one anchor, at x = 100 times its number.
Surfels OfAnchor(std::uint32_t anchor, std::uint32_t num_surfels) {
  Surfels surfels;
  for (std::uint32_t i = 0; i < num_surfels; ++i) {
    const auto x = 100 * static_cast<float>(anchor) + 0.01F * static_cast<float>(i % 64);
    Append(surfels, OneSurfel({x, 0.01F * static_cast<float>(i / 64), 5}, {0, 0, -1}, 1));
    surfels.history.back()[3] |= anchor;
  }
  return surfels;
}

// A camera that looks at an anchor of OfAnchor, and its neighbours by as many surroundings.
struct View {
  explicit View(double x_su, std::size_t num_anchors)
      : params(MakeViewParams(PlaneMap(TestCamera(64, 48), {}), {}, 0, 0)) {
    const Pose pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x_su, 0, 0));
    table.Set(TestDevice(), Similarity(1, pose), std::vector<Similarity>(num_anchors));
  }

  ViewParams params;
  AnchorTable table;
};

constexpr std::uint32_t kOfAnchor = 1024;  // surfels
constexpr std::uint32_t kNumAnchors = 8;

// A storage of kNumAnchors, of which the device may have three.
struct Patrol {
  explicit Patrol(const std::filesystem::path& folder)
      : depot(folder, 2 * kOfAnchor * kBytesPerSurfel),
        storage(TestDevice(), 100'000, {3 * kOfAnchor, &depot}),
        recorder(TestDevice()),
        culler(TestDevice()) {
    for (std::uint32_t i = 0; i < kNumAnchors; ++i) storage.Add(i, OfAnchor(i, kOfAnchor));
  }

  // The anchors in view, with the number of their blocks, in the order of the list.
  std::vector<std::pair<std::uint32_t, int>> Look(double x_su) {
    const View view(x_su, kNumAnchors);
    const ModelView model_view{view.params, view.table};
    culler.FindVisible(recorder, {&model_view, 1}, 1, storage, visible, nullptr);
    std::vector<std::pair<std::uint32_t, int>> anchors;
    for (const std::uint32_t block : visible.numbers()) {
      const std::uint32_t anchor = storage.anchors()[block];
      if (anchors.empty() || anchors.back().first != anchor) anchors.emplace_back(anchor, 0);
      ++anchors.back().second;
    }
    return anchors;
  }

  SurfelDepot depot;
  SurfelStorage storage;
  Recorder recorder;
  BlockCuller culler;
  BlockList visible;
};

void ExpectSame(const Surfels& found, const Surfels& expected) {
  EXPECT_EQ(found.position_radius, expected.position_radius);
  EXPECT_EQ(found.normal_weight, expected.normal_weight);
  EXPECT_EQ(found.history, expected.history);
}

TEST_F(ResidencyTest, AnchorsComeAndGoWithTheViews) {
  using Seen = std::vector<std::pair<std::uint32_t, int>>;
  constexpr int kBlocks = kOfAnchor / kSurfelsPerBlock;
  Patrol patrol(folder_);
  EXPECT_EQ(patrol.storage.num_surfels(), kNumAnchors * kOfAnchor);
  EXPECT_TRUE(patrol.storage.HasAnchorsOut());
  EXPECT_GT(patrol.depot.file_bytes(), 0U);
  for (const std::uint32_t anchor : {7U, 0U, 3U, 0U, 5U, 6U, 1U, 2U, 7U, 4U}) {
    EXPECT_EQ(patrol.Look(100.0 * anchor), (Seen{{anchor, kBlocks}}));
    EXPECT_EQ(patrol.storage.size(), 3 * kOfAnchor);  // and no more
  }
  EXPECT_EQ(patrol.Look(-500), Seen());
  Surfels all;
  for (std::uint32_t i = 0; i < kNumAnchors; ++i) {
    ExpectSame(patrol.storage.Download(i), OfAnchor(i, kOfAnchor));
    Append(all, OfAnchor(i, kOfAnchor));
  }
  ExpectSame(patrol.storage.Download(), all);
}

// Those of a later anchor may have the slots of an earlier one: the list is in the order of the
// model all the same.
TEST_F(ResidencyTest, AViewOfMoreThanMayBeOnTheDeviceGetsItWithAWarning) {
  Patrol patrol(folder_);
  (void)patrol.Look(600);
  (void)patrol.Look(200);
  const LogCapture log;
  // From so far away that all of the anchors are in its image.
  View view(350, kNumAnchors);
  std::vector<AnchorTransform> far = view.table.transforms();
  for (AnchorTransform& transform : far) transform.translation_scale[2] = 1000;
  view.table.Set(TestDevice(), far);
  const ModelView model_view{view.params, view.table};
  patrol.culler.FindVisible(patrol.recorder, {&model_view, 1}, 1, patrol.storage, patrol.visible,
                            nullptr);
  EXPECT_EQ(patrol.visible.size(), kNumAnchors * kOfAnchor / kSurfelsPerBlock);
  std::vector<std::uint32_t> anchors;
  for (const std::uint32_t block : patrol.visible.numbers()) {
    anchors.push_back(patrol.storage.anchors()[block]);
  }
  EXPECT_TRUE(std::ranges::is_sorted(anchors));
  EXPECT_FALSE(std::ranges::is_sorted(patrol.visible.numbers()));
  EXPECT_THAT(log.Text(), testing::HasSubstr("one view sees more of the model"));
  EXPECT_FALSE(patrol.storage.HasAnchorsOut());
}

TEST_F(ResidencyTest, GapsAreClosedWhereverTheyAre) {
  Patrol patrol(folder_);
  const auto with_gaps = [](std::uint32_t anchor) {
    Surfels surfels = OfAnchor(anchor, kOfAnchor);
    for (std::size_t i = 0; i < surfels.size(); i += 2) surfels.normal_weight[i][3] = 0;
    return surfels;
  };
  patrol.storage.RemoveAnchoredFrom(0);
  for (std::uint32_t i = 0; i < kNumAnchors; ++i) patrol.storage.Add(i, with_gaps(i));
  EXPECT_TRUE(patrol.storage.HasAnchorsOut());
  EXPECT_EQ(patrol.storage.num_slots(), kNumAnchors * kOfAnchor);
  patrol.storage.CloseAllGaps();
  EXPECT_EQ(patrol.storage.num_slots(), kNumAnchors * kOfAnchor / 2);
  EXPECT_EQ(patrol.storage.num_surfels(), kNumAnchors * kOfAnchor / 2);
  for (std::uint32_t i = 0; i < kNumAnchors; ++i) {
    ExpectSame(patrol.storage.Download(i), InWholeBlocks(with_gaps(i)));
    EXPECT_EQ(patrol.Look(100.0 * i).size(), 1U);
  }
}

// A megabyte has 15,000 matched surfels, about what one view of the flight brings; its model has
// three times as many and more.
SurfelMapOptions Small(const std::filesystem::path& folder) {
  SurfelMapOptions options;
  options.storage = {1, 1, folder.string()};
  return options;
}

std::string BytesOf(const std::vector<Step>& steps, const SurfelMapOptions& options) {
  ModelRun run = NewModelRun(options);
  std::string bytes;
  for (const Step& step : steps) bytes += run.Do(step);
  return bytes + run.End();
}

// Places far from each other, and back to each; what is far is moved by the tracker meanwhile.
std::vector<Step> FlightThereAndBack() {
  std::vector<Step> steps = EventfulFlight();
  const auto add = [&](const TrackedMap& map) { steps.push_back({map, {}}); };
  add(FarView(10, 400));
  add(FarView(11, 400.5));
  add(FarView(12, 800));
  std::vector<KeyframePose> moved;
  for (const int number : {0, 1, 2, 7, 8, 9}) {
    const TrackedMap view = DisturbedView(number, 4 * number);
    const Pose bend(RotationExp({0.001, 0.004 * number, 0}), Eigen::Vector3d(0.02 * number, 0, 0));
    moved.push_back({number, 0, Similarity(1, bend * view.T_world_cam)});
  }
  steps.push_back({std::nullopt, moved});
  add(FarView(13, 800.5));
  add(DisturbedView(14, 6));
  add(DisturbedView(15, 10));
  add(FarView(16, 0.3));
  return steps;
}

TEST_F(ResidencyTest, ALimitOfAViewGivesTheSameBytes) {
  const std::vector<Step> steps = FlightThereAndBack();
  const std::string expected = BytesOf(steps, {});
  EXPECT_TRUE(BytesOf(steps, Small(folder_)) == expected);
  // And where there is no file to put them; the warning says that there were some to put.
  const LogCapture log;
  EXPECT_TRUE(BytesOf(steps, Small(folder_ / "none")) == expected);
  EXPECT_THAT(log.Text(), testing::HasSubstr("out of view stay in memory"));
}

TEST_F(ResidencyTest, AFullModelBecomesCoarserToTheSameBytes) {
  const std::vector<Step> all = FlightThereAndBack();
  const std::vector<Step> steps(all.begin(), all.begin() + 8);
  SurfelMapOptions options;
  options.max_surfels = 20'000;  // a view has some 13,000
  SurfelMapOptions small = Small(folder_);
  small.max_surfels = options.max_surfels;
  const LogCapture log;
  const std::string expected = BytesOf(steps, options);
  EXPECT_THAT(log.Text(), testing::HasSubstr("made coarser"));
  EXPECT_TRUE(BytesOf(steps, small) == expected);
}

TEST_F(ResidencyTest, JoinedModelsAreTheSame) {
  const auto join = [](const SurfelMapOptions& options) {
    const auto make = [&](const std::vector<TrackedMap>& maps) {
      ModelRun run = NewModelRun(options);
      for (const TrackedMap& map : maps) (void)run.Do({map, {}});
      return run;
    };
    ModelRun into =
        make({DisturbedView(0, 0), DisturbedView(1, 2), FarView(2, 0), FarView(3, 300)});
    ModelRun from = make({DisturbedView(5, 10), DisturbedView(6, 12), FarView(7, 400)});
    into.poses.insert(from.poses.begin(), from.poses.end());
    EXPECT_TRUE(into.model->Join(*from.model, into.Snapshot()).has_value());
    EXPECT_EQ(from.model->num_surfels(), 0);
    const std::string bytes = into.Do({DisturbedView(8, 10), {}});
    return bytes + into.End();
  };
  EXPECT_TRUE(join(Small(folder_)) == join({}));
}

// Saved after each step, and gone on with by another model, of another limit.
TEST_F(ResidencyTest, SavedStatesAreTheSame) {
  const std::vector<Step> steps = FlightThereAndBack();
  auto folder = std::make_unique<StateFolder>(folder_ / "state");
  const SurfelMapOptions small = Small(folder_);
  ModelRun run = NewModelRun(small);
  std::string bytes;
  const std::set<std::size_t> restored_after = {5, 9, 13};
  for (std::size_t i = 0; i < steps.size(); ++i) {
    bytes += run.Do(steps[i]);
    run.model->SaveState(*folder, "model");
    (void)folder->Commit();
    if (!restored_after.contains(i)) continue;
    run.model = CreateSurfelMap(TestDevice(), i == 9 ? SurfelMapOptions{} : small);
    folder = std::make_unique<StateFolder>(folder_ / "state");
    run.model->RestoreState(*folder, "model");
  }
  EXPECT_TRUE(bytes + run.End() == BytesOf(steps, {}));
}

// A save does not read what is out: its file may be gone.
TEST_F(ResidencyTest, ASaveLeavesAloneWhatIsOut) {
  std::filesystem::create_directory(folder_ / "file");
  StateFolder folder(folder_ / "state");
  ModelRun run = NewModelRun(Small(folder_ / "file"));
  for (int i = 0; i < 5; ++i) (void)run.Do({FarView(i, 300.0 * i), {}});
  run.model->SaveState(folder, "model");
  (void)folder.Commit();
  (void)run.Integrate(FarView(5, 1200.3));
  int num_files = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code ignored;
    const std::string target = std::filesystem::read_symlink(entry.path(), ignored).string();
    if (!target.starts_with((folder_ / "file").string())) continue;
    std::filesystem::resize_file(entry.path(), 0);
    ++num_files;
  }
  ASSERT_EQ(num_files, 1);
  run.model->SaveState(folder, "model");
  (void)folder.Commit();
  EXPECT_THAT([&] { (void)run.End(); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("cannot read surfels")));
  // The state is whole.
  ModelRun again = NewModelRun();
  again.model->RestoreState(folder, "model");
  EXPECT_EQ(again.model->num_surfels(), run.model->num_surfels());
  EXPECT_EQ(again.model->Export(1).size(), static_cast<std::size_t>(run.model->num_surfels()));
}

}  // namespace
}  // namespace mono3d
