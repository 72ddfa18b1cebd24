// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/view_store.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

namespace mono3d::tools {
namespace {

SurfelBlock BlockOf(std::int64_t id, int num_surfels) {
  SurfelBlock block =
      MakeSurfelBlock(std::vector<ViewSurfel>(static_cast<std::size_t>(num_surfels)));
  block.id = id;
  return block;
}

nlohmann::json ChangesSince(const ViewStore& store, std::uint64_t version) {
  return nlohmann::json::parse(store.Changes(version));
}

TEST(ViewStore, TellsWhatHasChangedSinceAVersion) {
  ViewStore store;
  store.SetModel({1, 2}, {BlockOf(1, 10), BlockOf(2, 20)});
  store.SetStatus({{"phase", "running"}});
  const nlohmann::json all = ChangesSince(store, 0);
  EXPECT_EQ(all["blocks"].size(), 2U);
  EXPECT_EQ(all["status"]["phase"], "running");
  const std::uint64_t version = all["version"];

  const nlohmann::json nothing = ChangesSince(store, version);
  EXPECT_TRUE(nothing["blocks"].empty());
  EXPECT_FALSE(nothing.contains("status"));
  EXPECT_FALSE(nothing.contains("ids"));

  store.SetStatus({{"phase", "running"}});  // the same
  EXPECT_FALSE(ChangesSince(store, version).contains("status"));
  store.SetModel({1, 2, 3}, {BlockOf(2, 21), BlockOf(3, 30)});
  const nlohmann::json two = ChangesSince(store, version);
  ASSERT_EQ(two["blocks"].size(), 2U);
  EXPECT_EQ(two["blocks"][0]["surfels"], 21);
  EXPECT_EQ(ChangesSince(store, 0)["blocks"].size(), 3U) << "a viewer that comes late";

  store.SetModel({2, 3}, {});
  EXPECT_EQ(ChangesSince(store, version)["ids"], nlohmann::json({2, 3}));
}

TEST(ViewStore, TellsOfBlocksThatMovedAlone) {
  ViewStore store;
  store.SetModel({1, 2}, {BlockOf(1, 10), BlockOf(2, 20)});
  const nlohmann::json before = ChangesSince(store, 0);
  const Similarity moved(2, Pose(Eigen::Quaterniond::Identity(), {1, 2, 3}));
  store.SetTransforms({{1, Similarity()}, {2, moved}});
  const nlohmann::json after = ChangesSince(store, before["version"]);
  ASSERT_EQ(after["blocks"].size(), 1U);
  EXPECT_EQ(after["blocks"][0]["id"], 2);
  EXPECT_EQ(after["blocks"][0]["scale"], 2);
  EXPECT_EQ(after["blocks"][0]["version"], before["blocks"][1]["version"]) << "no surfels travel";
}

TEST(ViewStore, GivesPartsOfABlockAsItIs) {
  ViewStore store;
  store.SetModel({1}, {BlockOf(1, 10)});
  const auto num_surfels = [&store](std::uint64_t first, std::uint64_t count) {
    return (store.Surfels(1, first, count)->size() - kBytesOfSurfelsHead) / kBytesOfSurfel;
  };
  EXPECT_EQ(num_surfels(0, 4), 4U);
  EXPECT_EQ(num_surfels(8, 4), 2U);
  constexpr auto kHuge = std::numeric_limits<std::uint64_t>::max();
  EXPECT_EQ(num_surfels(11, kHuge), 0U);
  EXPECT_EQ(num_surfels(kHuge, kHuge), 0U);
  EXPECT_FALSE(store.Surfels(2, 0, 4));

  const auto version = [&store] {
    double number = 0;
    std::memcpy(&number, store.Surfels(1, 0, 0)->data(), sizeof number);
    return number;
  };
  EXPECT_EQ(version(), ChangesSince(store, 0)["blocks"][0]["version"].get<double>());
  const double before = version();
  store.SetModel({1}, {BlockOf(1, 12)});
  EXPECT_GT(version(), before);
  EXPECT_EQ(num_surfels(0, 100), 12U);
}

TEST(ViewStore, KeepsPicturesOfTheLatestKeyframesAlone) {
  ViewStore store;
  const auto large = std::make_shared<const std::string>(1 << 20, 'x');
  for (int id = 0; id < 100; ++id) store.SetPictureOfKeyframe("image", id, large);
  EXPECT_EQ(store.PictureOfKeyframe("image", 0), nullptr);
  EXPECT_NE(store.PictureOfKeyframe("image", 99), nullptr);
  EXPECT_NE(store.PictureOfKeyframe("image", 40), nullptr);
}

TEST(ViewStore, SurvivesWhatIsNotFiniteOrNoText) {
  ViewStore store;
  store.SetStatus({{"memory_mb", std::nan("")}, {"reason", "\xff\xfe no UTF-8"}});
  EXPECT_TRUE(ChangesSince(store, 0)["status"]["memory_mb"].is_null());
}

}  // namespace
}  // namespace mono3d::tools
