// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "fusion/model_run.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/core/state_folder.h"
#include "mono3d/fusion/surfel_map.h"

// States that are not whole, or not those of this model.
namespace mono3d {
namespace {

class SurfelMapStateDamageTest : public TemporaryFolderTest {};

std::string MessageOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(SurfelMapStateDamageTest, TheSaveBeforeStandsWhereOneDidNotEnd) {
  const std::filesystem::path path = folder_ / "state";
  StateFolder folder(path);
  ModelRun run = NewModelRun();
  (void)run.Do({DisturbedView(0, 0), {}});
  run.model->SaveState(folder, "model");
  (void)folder.Commit();
  const std::string then = run.End();
  (void)run.Do({DisturbedView(1, 6), {}});
  run.model->SaveState(folder, "model");  // and the power fails
  ModelRun again = NewModelRun();
  again.model->RestoreState(StateFolder(path), "model");
  EXPECT_TRUE(again.End() == then);
  // Where the save alone has failed, the next one is whole.
  folder.Discard();
  run.model->SaveState(folder, "model");
  (void)folder.Commit();
  ModelRun later = NewModelRun();
  later.model->RestoreState(StateFolder(path), "model");
  EXPECT_TRUE(later.End() == run.End());
}

TEST_F(SurfelMapStateDamageTest, WhatIsMissingDamagedOrOtherIsOneLine) {
  const std::filesystem::path path = folder_ / "state";
  {
    StateFolder folder(path);
    ModelRun run = NewModelRun();
    (void)run.Do({DisturbedView(0, 0), {}});
    (void)run.Do({DisturbedView(1, 6), {}});
    (void)run.Do({FarAstray(DisturbedView(2, 12)), {}});
    run.model->SaveState(folder, "model");
    (void)folder.Commit();
  }
  const auto message = [&](const std::string& name, const SurfelMapOptions& options = {}) {
    const std::string text =
        MessageOf([&] { NewModelRun(options).model->RestoreState(StateFolder(path), name); });
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    return text;
  };
  EXPECT_EQ(message("model"), "no error");
  EXPECT_NE(message("other").find("no part other/made_with"), std::string::npos);
  SurfelMapOptions options;
  options.association.max_sigmas = 2.5;
  const std::string other_options = message("model", options);
  EXPECT_NE(other_options.find("max_sigmas = 3"), std::string::npos) << other_options;
  EXPECT_NE(other_options.find("max_sigmas = 2.5"), std::string::npos) << other_options;

  // A part of each kind is gone, or cut to a half, by a folder that knows nothing of it.
  std::map<std::string, std::string> name_of_kind;
  for (const std::string& name : StateFolder(path).Names("model/")) {
    std::string kind = name;
    std::erase_if(kind, [](char c) { return c >= '0' && c <= '9'; });
    name_of_kind[kind] = name;
  }
  ASSERT_GT(name_of_kind.size(), 10U);
  bool is_there = false;
  for (const auto& [kind, damaged] : name_of_kind) {
    is_there = !is_there;
    StateFolder folder(path);
    for (const std::string& name : folder.Names("")) {
      if (name != damaged) (void)folder.Keep(name);
    }
    const std::string bytes = folder.Get(damaged);
    if (is_there) folder.Put(damaged, bytes.substr(0, bytes.size() / 2));
    (void)folder.Commit();
    EXPECT_NE(message("model"), "no error") << damaged;
    (void)folder.KeepAll("");
    folder.Put(damaged, bytes);
    (void)folder.Commit();
  }
  EXPECT_EQ(message("model"), "no error");
}

// Bytes that pass the checksum and are not what was saved: no crash, no huge allocation.
TEST_F(SurfelMapStateDamageTest, WrongNumbersAreRefusedOrHarmless) {
  const std::filesystem::path path = folder_ / "state";
  StateFolder folder(path);
  ModelRun run = NewModelRun();
  (void)run.Do({DisturbedView(0, 0), {}});
  (void)run.Do({DisturbedView(1, 6), {}});
  run.model->SaveState(folder, "model");
  (void)folder.Commit();
  std::mt19937 random(7);
  int num_refused = 0;
  for (const char* part :
       {"model/rest/0", "model/surfels/sizes", "model/surfels/slots/0", "model/surfels/1/blocks",
        "model/retry", "model/recent/0", "model/vignetting/0/0"}) {
    const std::string bytes = folder.Get(part);
    for (int i = 0; i < 3; ++i) {
      std::string wrong = bytes;
      // Where there are numbers rather than pixels.
      const std::size_t place = random() % std::min<std::size_t>(wrong.size(), 2000);
      wrong[place] = static_cast<char>(random());
      (void)folder.KeepAll("");
      folder.Put(part, wrong);
      (void)folder.Commit();
      ModelRun again = NewModelRun();
      num_refused +=
          MessageOf([&] { again.model->RestoreState(folder, "model"); }) == "no error" ? 0 : 1;
    }
    (void)folder.KeepAll("");
    folder.Put(part, bytes);
    (void)folder.Commit();
  }
  EXPECT_GT(num_refused, 2);
}

class UnsavedMap final : public SurfelMap {
 public:
  FusionResult Integrate(const DepthMap&, const KeyframePoses&) override { return {}; }
  UpdateResult Update(const KeyframePoses&) override { return {}; }
  std::vector<FusedDepthMap> DepthMaps() const override { return {}; }
  using SurfelMap::Export;
  PointCloud Export(const SurfelExportOptions&) const override { return {}; }
  std::int64_t num_surfels() const override { return 0; }
};

TEST_F(SurfelMapStateDamageTest, OtherKindsSayThatTheyCannotBeSaved) {
  UnsavedMap map;
  StateFolder folder(folder_ / "state");
  EXPECT_NE(MessageOf([&] { map.SaveState(folder, "model"); }), "no error");
  EXPECT_NE(MessageOf([&] { map.RestoreState(folder, "model"); }), "no error");
}

}  // namespace
}  // namespace mono3d
