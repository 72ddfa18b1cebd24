// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/model_publisher.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "pipeline/clock.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// A model whose chunks are said to be of these versions.
class VersionedMap final : public SurfelMap {
 public:
  explicit VersionedMap(std::vector<std::uint64_t> versions) : versions_(std::move(versions)) {}

  FusionResult Integrate(const DepthMap&, const KeyframePoses&) override { return {}; }
  UpdateResult Update(const KeyframePoses&) override { return {}; }
  std::vector<FusedDepthMap> DepthMaps() const override { return {}; }
  PointCloud Export(const SurfelExportOptions&) const override { return {}; }
  std::int64_t num_surfels() const override { return 0; }
  SurfelChanges ChangesSince(std::uint64_t version) override {
    SurfelChanges changes;
    for (std::uint32_t i = 0; i < versions_.size(); ++i) {
      changes.version = std::max(changes.version, versions_[i]);
      changes.anchors.push_back({i, 0, 0, Similarity()});
      if (versions_[i] > version) changes.changed.push_back({i, std::make_shared<PointCloud>()});
    }
    return changes;
  }

  std::vector<std::uint64_t> versions_;
};

std::vector<std::uint32_t> ChangedAnchors(const PublishedModel& model) {
  std::vector<std::uint32_t> anchors;
  for (const SurfelChunk& chunk : model.surfels.changed) anchors.push_back(chunk.anchor);
  return anchors;
}

// Until the share of time allows it.
std::uint64_t Publish(ModelPublisher& publisher, SurfelMap& model, int map_id) {
  const std::uint64_t before = publisher.Latest(0).surfels.version;
  publisher.NoteChange();
  while (publisher.Latest(0).surfels.version == before) {
    publisher.PublishIfDue(model, map_id, std::make_shared<KeyframePoses>());
  }
  return publisher.Latest(0).surfels.version;
}

TEST(ModelPublisher, PublishesNothingThatNobodyAsksFor) {
  ModelPublisher publisher;
  VersionedMap model({1, 1});
  publisher.NoteChange();
  EXPECT_FALSE(publisher.Due_s());
  publisher.PublishIfDue(model, 0, std::make_shared<KeyframePoses>());
  const PublishedModel nothing = publisher.Latest(0);
  EXPECT_EQ(nothing.surfels.version, 0U);
  EXPECT_EQ(nothing.poses, nullptr);
  EXPECT_TRUE(publisher.Due_s()) << "now somebody has asked";
  publisher.PublishIfDue(model, 0, std::make_shared<KeyframePoses>());
  EXPECT_EQ(publisher.Latest(0).surfels.version, 1U);
  EXPECT_FALSE(publisher.Due_s()) << "nothing has changed";
}

TEST(ModelPublisher, PublishesOnceBetweenTwoQuestions) {
  ModelPublisher publisher;
  VersionedMap model({1});
  const std::uint64_t first = Publish(publisher, model, 0);
  publisher.Latest(0);
  const double asked_s = Clock_s();
  std::this_thread::sleep_for(std::chrono::milliseconds(40));
  publisher.Latest(0);
  publisher.NoteChange();
  ASSERT_TRUE(publisher.Due_s());
  EXPECT_GE(*publisher.Due_s(), asked_s + 0.06) << "half of the pause later";
  while (Clock_s() < *publisher.Due_s()) std::this_thread::yield();
  publisher.PublishIfDue(model, 0, std::make_shared<KeyframePoses>());
  publisher.NoteChange();
  EXPECT_FALSE(publisher.Due_s()) << "nobody has asked again";
  EXPECT_EQ(publisher.Latest(0).surfels.version, first + 1);
  EXPECT_TRUE(publisher.Due_s());
}

TEST(ModelPublisher, LetsItsCopyGoWhereNobodyAsksAnyMore) {
  ModelPublisher publisher(/*interest_s=*/0.05);
  VersionedMap model({1, 1});
  const std::uint64_t first = Publish(publisher, model, 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  EXPECT_FALSE(publisher.Due_s());
  publisher.PublishIfDue(model, 0, std::make_shared<KeyframePoses>());
  EXPECT_THAT(ChangedAnchors(publisher.Latest(0)), IsEmpty());
  // Who comes back has all of it, also what has not changed since.
  Publish(publisher, model, 0);
  EXPECT_THAT(ChangedAnchors(publisher.Latest(first)), ElementsAre(0, 1));
}

TEST(ModelPublisher, HandsOutWhatHasChangedSinceAVersion) {
  ModelPublisher publisher;
  VersionedMap model({1, 1});
  const std::uint64_t first = Publish(publisher, model, 0);
  EXPECT_THAT(ChangedAnchors(publisher.Latest(0)), ElementsAre(0, 1));
  EXPECT_THAT(ChangedAnchors(publisher.Latest(first)), IsEmpty());
  model.versions_ = {1, 2, 2};
  const std::uint64_t second = Publish(publisher, model, 0);
  EXPECT_THAT(ChangedAnchors(publisher.Latest(first)), ElementsAre(1, 2));
  EXPECT_THAT(ChangedAnchors(publisher.Latest(0)), ElementsAre(0, 1, 2));
  model.versions_ = {1, 3};
  Publish(publisher, model, 0);
  EXPECT_THAT(ChangedAnchors(publisher.Latest(second)), ElementsAre(1));
  EXPECT_THAT(ChangedAnchors(publisher.Latest(0)), ElementsAre(0, 1)) << "anchor 2 is no more";
}

TEST(ModelPublisher, AnotherModelIsNewFromBeginningToEnd) {
  ModelPublisher publisher;
  VersionedMap model({7, 8, 9});
  const std::uint64_t first = Publish(publisher, model, 0);
  VersionedMap other({1, 2});
  const std::uint64_t second = Publish(publisher, other, 3);
  EXPECT_GT(second, first);
  EXPECT_EQ(publisher.Latest(0).map_id, 3);
  EXPECT_THAT(ChangedAnchors(publisher.Latest(first)), ElementsAre(0, 1));
  Publish(publisher, model, 0);
  EXPECT_THAT(ChangedAnchors(publisher.Latest(second)), ElementsAre(0, 1, 2));
}

}  // namespace
}  // namespace mono3d
