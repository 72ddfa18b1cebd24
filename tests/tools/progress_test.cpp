// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What a run says of itself on the terminal.

#include "common/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "common/advice.h"
#include "common/summary.h"
#include "common/warnings.h"
#include "tools/command.h"

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

TEST(ProgressLine, SaysHowSureItIsOfTheScale) {
  const PipelineCounts counts;
  const TrackingResult tracking;
  const ModelHealth health;
  PlaceOfMap place;
  place.georeference.scale_sigma = 0.0042;
  const PipelineProgress progress = {.counts = counts,
                                     .tracking = tracking,
                                     .health = health,
                                     .place = std::make_shared<const PlaceOfMap>(place)};
  EXPECT_THAT(FormatProgress(progress, {}, 1), EndsWith("  on the earth, scale +- 0.42 %"));
}

TEST(ProgressLine, SaysHowFarPhotographsArePlaced) {
  using Step = PhotoMapperProgress::Step;
  EXPECT_EQ(FormatProgress({Step::kFeatures, 12, 0}, 12, 3), "features of 12 images");
  // 100 more pairs in 5 s, of which 300 are left.
  EXPECT_EQ(FormatProgress({Step::kMatching, 200, 500}, 100, 5),
            "matched 200/500 pairs of images  ETA 15 s");
  EXPECT_EQ(FormatProgress({Step::kPlacing, 40, 80}, 40, 9), "placed 40/80 images");
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
  ModelHealth good;
  good.num_registrations = 3;
  EXPECT_THAT(Summary(good), AllOf(HasSubstr(model), Not(HasSubstr("the model is"))));
  EXPECT_THAT(Summary({}), AllOf(HasSubstr(model), HasSubstr("the model is of one depth map")));
  EXPECT_THAT(Summary(Health(HealthState::kDegraded, "drifts")),
              AllOf(HasSubstr("the model is degraded: drifts\n"), HasSubstr(model)));
  EXPECT_THAT(Summary(Health(HealthState::kBroken, "refuses")),
              HasSubstr("the model is broken: refuses\n"));
}

TEST(Summary, SaysWhatLikelyMadeTheModelBadAndWhatToDo) {
  Reconstruction result;
  result.maps.resize(1);
  result.maps[0].health = Health(HealthState::kBroken, "refuses");
  RunRecord record;
  EXPECT_EQ(AdviceOfModel({}, record).cause, "");
  EXPECT_THAT(AdviceOfModel(result, record).cause, HasSubstr("a wrong calibration, blur"));
  record.calibration.emplace();
  record.calibration->is_learned = record.calibration->determines_focal_length = true;
  EXPECT_THAT(AdviceOfModel(result, record).cause, HasSubstr("the images agree with the camera"));
  record.calibration.reset();
  result.maps[0].fusions.resize(2);
  for (FusionRecord& fusion : result.maps[0].fusions) {
    fusion.registration.registered = true;
    fusion.registration.contradiction = 0.3;
  }
  EXPECT_THAT(AdviceOfModel(result, record).cause, HasSubstr("scene seems to move"));
  result.maps.resize(4);
  EXPECT_THAT(AdviceOfModel(result, record).cause, HasSubstr("wrong order"));
  record.camera = "camera.yaml";  // and no word of the images: it was held
  EXPECT_THAT(AdviceOfModel(result, record).remedy, HasSubstr("without --camera-fixed"));
  record.calibration.emplace();
  record.calibration->variation.principal_point_px = 3;
  EXPECT_THAT(AdviceOfModel(result, record).cause, HasSubstr("stabilisation"));
  result.maps[0].health = {};
  EXPECT_EQ(AdviceOfModel(result, record).cause, "");
}

TEST(Summary, WhyThereIsNoModelIsTheCauseAndTheRemedy) {
  Reconstruction result;
  result.counts.untracked_frames["12 to 20 features, 50 needed"] = 7;
  EXPECT_THAT(WhyNoModel(result),
              AllOf(HasSubstr("12 to 20 features"), HasSubstr("too little structure"),
                    HasSubstr("textured ground")));
  result.maps.resize(1);
  result.counts.selector_findings = "the images are too far apart: at 41 degrees, 30 at most";
  EXPECT_EQ(WhyNoModel(result),
            "no model: no depth, the images are too far apart: at 41 degrees, 30 at most");
}

TEST(Guide, ListsEveryCauseWithItsRemedy) {
  const std::string guide = ReadText(MONO3D_GUIDE);
  EXPECT_GE(AllAdvice().size(), 20U);
  for (const Advice& advice : AllAdvice()) {
    EXPECT_THAT(guide, HasSubstr(" | " + advice.cause + " | " + advice.remedy + " |"));
  }
}

TEST(Warnings, AreToldOnceAndCounted) {
  EXPECT_TRUE(NoteWarning("a test's own warning"));
  EXPECT_FALSE(NoteWarning("a test's own warning"));
  const std::vector<NotedWarning> noted = NotedWarnings();
  const auto found = std::ranges::find(noted, "a test's own warning", &NotedWarning::message);
  ASSERT_NE(found, noted.end());
  EXPECT_EQ(found->times, 2);
}

}  // namespace
}  // namespace mono3d::tools
