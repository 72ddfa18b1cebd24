// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mono3d::tools {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

// A model of so many depth maps, of which so many were compared with what was there before.
Reconstruction ModelOf(int num_fused, int num_registrations) {
  Reconstruction result;
  result.counts.num_fused = num_fused;
  MapReconstruction& map = result.maps.emplace_back();
  map.model.points.resize(1);
  map.health.num_registrations = num_registrations;
  return result;
}

TEST(WhyNotConfirmed, IsToldWhereNoDepthMapWasComparedWithAnother) {
  EXPECT_THAT(WhyNotConfirmed({}), IsEmpty());
  EXPECT_THAT(WhyNotConfirmed(ModelOf(2, 1)), IsEmpty());
  EXPECT_THAT(WhyNotConfirmed(ModelOf(1, 0)), HasSubstr("of one depth map"));
  EXPECT_THAT(WhyNotConfirmed(ModelOf(2, 0)), HasSubstr("do not overlap"));
  Reconstruction without = ModelOf(1, 0);
  without.maps[0].model = {};
  EXPECT_THAT(WhyNotConfirmed(without), IsEmpty());
}

TEST(WhyUncertain, IsToldWhereHalfOfTheSurfelsAreOfNoSureDepth) {
  EXPECT_THAT(WhyUncertain({}), IsEmpty());
  Reconstruction model = ModelOf(1, 0);
  model.maps[0].model.confidences = {0.2F, 0.15F, 0.01F};
  EXPECT_THAT(WhyUncertain(model), IsEmpty());
  model.maps[0].model.confidences = {0.2F, 0.05F, 0.01F};
  model.counts.selector_findings = "3 keyframes, baseline 0.03 of the depth at most";
  EXPECT_THAT(WhyUncertain(model), HasSubstr("confidence of 0.05 and less"));
  EXPECT_THAT(WhyUncertain(model), HasSubstr("from 3 keyframes"));
}

TEST(WhyNoModel, NamesNoRejectionWhereDepthMapsWereFused) {
  Reconstruction model = ModelOf(1, 0);
  model.counts.num_bundles = 1;
  EXPECT_THAT(WhyNoModel(model), IsEmpty());
  model.maps[0].model = {};
  EXPECT_THAT(WhyNoModel(model), HasSubstr("no surfel of the depth maps that were fused"));
}

}  // namespace
}  // namespace mono3d::tools
