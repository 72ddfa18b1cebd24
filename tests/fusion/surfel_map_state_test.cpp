// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "fusion/model_run.h"
#include "gpu/test_device.h"
#include "io/temporary_folder.h"
#include "mono3d/core/state_folder.h"
#include "mono3d/fusion/surfel_map.h"

// A model that is saved, and goes on as another object, must be the same one: every bit of what it
// gives is compared with that of a model that was never saved.
namespace mono3d {
namespace {

class SurfelMapStateTest : public TemporaryFolderTest {};

// Saved and taken up by another model after these steps.
std::string Interrupted(const std::vector<Step>& steps, const std::set<std::size_t>& after,
                        const std::filesystem::path& path, const SurfelMapOptions& options = {}) {
  auto folder = std::make_unique<StateFolder>(path);
  ModelRun run = NewModelRun(options);
  std::string bytes;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    bytes += run.Do(steps[i]);
    run.model->SaveState(*folder, "model");
    (void)folder->Commit();
    if (!after.contains(i)) continue;
    run.model = CreateSurfelMap(TestDevice(), options);
    folder = std::make_unique<StateFolder>(path);
    run.model->RestoreState(*folder, "model");
  }
  return bytes + run.End();
}

std::string Uninterrupted(const std::vector<Step>& steps, const SurfelMapOptions& options = {}) {
  ModelRun run = NewModelRun(options);
  std::string bytes;
  for (const Step& step : steps) bytes += run.Do(step);
  return bytes + run.End();
}

TEST_F(SurfelMapStateTest, TheFlightHasWhatAStateCanHave) {
  ModelRun run = NewModelRun();
  int num_waiting = 0;
  int num_retried = 0;
  int num_submaps = 1;
  std::int64_t num_inferred = 0;
  for (const Step& step : EventfulFlight()) {
    if (!step.map) {
      (void)run.Do(step);
      continue;
    }
    const FusionResult result = run.Integrate(*step.map);
    num_waiting += result.is_waiting ? 1 : 0;
    num_retried += static_cast<int>(result.retried.size());
    num_submaps = std::max(num_submaps, result.health.num_submaps);
    num_inferred += result.num_inferred;
  }
  EXPECT_GT(num_waiting, 0);
  EXPECT_GT(num_retried, 0);
  EXPECT_GT(num_submaps, 1);
  EXPECT_GT(num_inferred, 0);
}

TEST_F(SurfelMapStateTest, GoesOnBitForBitWhereverItWasInterrupted) {
  const std::vector<Step> steps = EventfulFlight();
  const std::string expected = Uninterrupted(steps);
  EXPECT_TRUE(Uninterrupted(steps) == expected) << "two equal runs differ";
  std::set<std::size_t> everywhere;
  for (std::size_t i = 0; i < steps.size(); ++i) everywhere.insert(i);
  EXPECT_TRUE(Interrupted(steps, everywhere, folder_ / "everywhere") == expected);
  EXPECT_TRUE(Interrupted(steps, {4}, folder_ / "once") == expected);
}

// Surfels move to other slots, and the number of those that fit is part of the state.
TEST_F(SurfelMapStateTest, AModelThatWasMadeCoarserGoesOnBitForBit) {
  SurfelMapOptions options;
  options.max_surfels = 20'000;  // a view has some 13,000
  const std::vector<Step> all = EventfulFlight();
  const std::vector<Step> steps(all.begin(), all.begin() + 5);
  EXPECT_TRUE(Interrupted(steps, {1, 2, 3}, folder_ / "state", options) ==
              Uninterrupted(steps, options));
}

TEST_F(SurfelMapStateTest, ModelsThatAreJoinedLaterAreTheSame) {
  const auto join = [](ModelRun& into, ModelRun& from) {
    into.poses.insert(from.poses.begin(), from.poses.end());
    EXPECT_TRUE(into.model->Join(*from.model, into.Snapshot()).has_value());
    const std::string bytes = into.Do({DisturbedView(8, 10), {}});
    return bytes + into.End();
  };
  const auto make = [](std::initializer_list<int> numbers) {
    ModelRun run = NewModelRun();
    for (const int number : numbers) (void)run.Do({DisturbedView(number, 2 * number), {}});
    return run;
  };
  ModelRun into = make({0, 1, 2});
  ModelRun from = make({5, 6});
  StateFolder folder(folder_ / "state");
  into.model->SaveState(folder, "map_0");
  from.model->SaveState(folder, "map_1");
  (void)folder.Commit();
  ModelRun into_again = make({});
  ModelRun from_again = make({});
  into_again.model->RestoreState(folder, "map_0");
  from_again.model->RestoreState(folder, "map_1");
  into_again.poses = into.poses;
  from_again.poses = from.poses;
  into_again.version = into.version;
  EXPECT_TRUE(join(into_again, from_again) == join(into, from));
}

TEST_F(SurfelMapStateTest, WritesWhatHasChangedAlone) {
  StateFolder folder(folder_ / "state");
  SurfelMapOptions without_reviews;
  without_reviews.num_reviews = 0;
  ModelRun run = NewModelRun(without_reviews);
  const auto save = [&] {
    run.model->SaveState(folder, "model");
    return folder.Commit();
  };
  for (const int number : {0, 1, 2, 3}) (void)run.Do({DisturbedView(number, 4 * number), {}});
  const StateSaveCost all = save();
  EXPECT_GT(all.bytes_new, 0U);
  EXPECT_EQ(save().bytes_new, 0U);
  // Nothing of the house is in view.
  (void)run.Do({FarView(4, 0), {}});
  (void)save();
  const std::uint64_t num_bytes_of_one = 3 * 144 * 96 * 48 / 2;
  (void)run.Do({FarView(5, 0.3), {}});
  const StateSaveCost little = save();
  EXPECT_GT(little.bytes_new, 0U);
  EXPECT_LT(little.bytes_new, num_bytes_of_one);
  EXPECT_GT(little.num_bytes, 2 * little.bytes_new);
  // A folder that another model has written to meanwhile is looked at as a whole.
  ModelRun other = NewModelRun(without_reviews);
  (void)other.Do({DisturbedView(0, 90), {}});
  other.model->SaveState(folder, "model");
  (void)folder.Commit();
  (void)save();
  ModelRun again = NewModelRun(without_reviews);
  again.model->RestoreState(folder, "model");
  EXPECT_TRUE(again.End() == run.End());
}

}  // namespace
}  // namespace mono3d
