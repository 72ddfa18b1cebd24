// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fusion/health.h"

namespace mono3d {
namespace {

RegistrationEvidence Evidence(bool moved = false, double residual = 0.5, double scale = 0) {
  RegistrationEvidence evidence;
  evidence.registered = true;
  evidence.moved = moved;
  evidence.depth_residual = residual;
  evidence.scale_deviation = scale;
  return evidence;
}

TEST(HealthMonitor, SaysNothingOfFewRegistrations) {
  HealthMonitor monitor({});
  for (int i = 0; i < 3; ++i) monitor.Add(Evidence(), false);
  EXPECT_EQ(monitor.Assess().state, HealthState::kGood);
  EXPECT_EQ(monitor.Assess().accepted_share, 0);
}

TEST(HealthMonitor, KnowsABrokenAndADegradedModel) {
  HealthMonitor monitor({});
  for (int i = 0; i < 8; ++i) monitor.Add(Evidence(), i % 3 == 0);
  EXPECT_EQ(monitor.Assess().state, HealthState::kBroken);
  EXPECT_THAT(monitor.Assess().reason, ::testing::HasSubstr("fit the model"));
  monitor.AcceptLate();
  monitor.AcceptLate();
  EXPECT_EQ(monitor.Assess().num_registrations, 6);
  EXPECT_EQ(monitor.Assess().state, HealthState::kDegraded);
  for (int i = 0; i < 8; ++i) monitor.Add(Evidence(), true);
  EXPECT_EQ(monitor.Assess().state, HealthState::kGood);
}

TEST(HealthMonitor, MindsResidualsTheTrackerAndItsScale) {
  HealthMonitor rough({});
  HealthMonitor drifted({});
  HealthMonitor drifting({});
  for (int i = 0; i < 8; ++i) {
    rough.Add(Evidence(false, 1.5), true);
    drifted.Add(Evidence(true), true);
    drifting.Add(Evidence(false, 0.5, 0.06), true);
  }
  EXPECT_THAT(rough.Assess().reason, ::testing::HasSubstr("distance"));
  EXPECT_THAT(drifted.Assess().reason, ::testing::HasSubstr("tracker has them"));
  EXPECT_THAT(drifting.Assess().reason, ::testing::HasSubstr("scale"));
  for (const HealthMonitor* monitor : {&rough, &drifted, &drifting}) {
    EXPECT_EQ(monitor->Assess().state, HealthState::kDegraded);
  }
}

TEST(HealthMonitor, KnowsAModelThatNoPosesExplain) {
  HealthMonitor monitor({});
  for (int i = 0; i < 8; ++i) monitor.Add(Evidence(true, 1.2), true);
  EXPECT_EQ(monitor.Assess().state, HealthState::kBroken);
  EXPECT_THAT(monitor.Assess().reason, ::testing::HasSubstr("tracker has them: 100 %"));
  EXPECT_THAT(monitor.Assess().reason, ::testing::HasSubstr("1.2 times their noise"));
  for (int i = 0; i < 4; ++i) monitor.Add(Evidence(true, 0.5), true);
  EXPECT_EQ(monitor.Assess().state, HealthState::kDegraded);  // 0.92 sigmas over all
}

}  // namespace
}  // namespace mono3d
