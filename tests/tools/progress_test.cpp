// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What a run says of itself on the terminal.

#include "common/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "common/summary.h"

namespace mono3d::tools {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

ModelHealth Health(HealthState state, const std::string& reason) {
  ModelHealth health;
  health.state = state;
  health.reason = reason;
  return health;
}

// After 30 of 120 frames, in two seconds.
std::string Line(const ModelHealth& health) {
  PipelineCounts counts;
  counts.num_frames = 30;
  counts.num_keyframes = 7;
  counts.num_fused = 2;
  TrackingResult tracking;
  tracking.status = TrackingStatus::kTracking;
  const PipelineProgress progress = {
      .counts = counts, .tracking = tracking, .num_surfels = 51'999, .health = health};
  return FormatProgress(progress, 120, 2);
}

TEST(ProgressLine, SaysHowFarTheRunIsAndWhenItEnds) {
  EXPECT_EQ(Line({}), "frame 30/120  15.0 fps  " +
                          std::string(ToString(TrackingStatus::kTracking)) +
                          "  keyframes 7  maps 2  surfels 51k  ETA 6 s");
}

TEST(ProgressLine, SaysOfTheModelOnlyWhatIsNotGoodAndWhy) {
  EXPECT_THAT(Line(Health(HealthState::kGood, "")), Not(HasSubstr("model")));
  EXPECT_THAT(Line(Health(HealthState::kDegraded, "2 of 8 were rejected")),
              AllOf(HasSubstr("  model degraded (2 of 8 were rejected)"), EndsWith("ETA 6 s")));
  EXPECT_THAT(Line(Health(HealthState::kBroken, "5 of 8 were rejected")),
              HasSubstr("  model broken (5 of 8 were rejected)"));
}

std::string Summary(const ModelHealth& health) {
  Reconstruction result;
  result.maps.emplace_back();
  result.maps[0].health = health;
  result.maps[0].model.points.emplace_back(1, 2, 3);
  testing::internal::CaptureStdout();
  PrintSummary(result, {}, "out/model.ply");
  return testing::internal::GetCapturedStdout();
}

TEST(Summary, NamesTheStateOfTheModelWithItsReason) {
  const std::string model = "model out/model.ply  surfels 1\n";
  EXPECT_THAT(Summary({}), AllOf(HasSubstr(model), Not(HasSubstr("the model is"))));
  EXPECT_THAT(Summary(Health(HealthState::kDegraded, "drifts")),
              AllOf(HasSubstr("the model is degraded: drifts\n"), HasSubstr(model)));
  EXPECT_THAT(Summary(Health(HealthState::kBroken, "refuses")),
              HasSubstr("the model is broken: refuses\n"));
}

}  // namespace
}  // namespace mono3d::tools
