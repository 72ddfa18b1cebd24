// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geo/ground_control.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace mono3d {
namespace {

using Eigen::Vector3d;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr Geodetic kSurveyOrigin = {49.01, 8.41, 115};
constexpr double kFocal_px = 1000;

// A map of which 1 unit is 37 m, turned and moved.
Similarity TrueSurveySimilarity() {
  return {37, Pose(RotationExp(Vector3d(0.3, -1.1, 2.0)), Vector3d(120, -40, 60))};
}

// A grid of cameras that look straight down from 50 m.
std::vector<FrameInMap> Frames() {
  std::vector<FrameInMap> frames;
  const Similarity S_map_enu = TrueSurveySimilarity().Inverse();
  for (int i = 0; i < 36; ++i) {
    const Vector3d eye(12.0 * (i % 6), 12.0 * (i / 6), 50 + 2 * std::sin(i));
    frames.push_back({i, S_map_enu * Pose(RotationExp({3.1, 0.05 * std::cos(i), 0}), eye)});
  }
  return frames;
}

struct SurveyErrors {
  double sigma_m = 0;
  double sigma_px = 0;
  unsigned seed = 1;
};

GroundControl Survey(const std::vector<Vector3d>& places, const SurveyErrors& errors = {}) {
  std::mt19937 random(errors.seed);
  std::normal_distribution<double> normal;
  const auto draw = [&](double sigma) {
    return Vector3d(sigma * normal(random), sigma * normal(random), sigma * normal(random));
  };
  GroundControl control;
  control.has_altitude = true;
  const Similarity S_map_enu = TrueSurveySimilarity().Inverse();
  const std::vector<FrameInMap> frames = Frames();
  for (std::size_t i = 0; i < places.size(); ++i) {
    ControlPoint& point = control.points.emplace_back();
    point.name = "p" + std::to_string(i + 1);
    point.place = ToGeodetic(places[i] + draw(errors.sigma_m), kSurveyOrigin);
    for (const FrameInMap& frame : frames) {
      const Vector3d p_cam = frame.T_map_cam.Inverse() * (S_map_enu * places[i]);
      const Vector3d ray = p_cam / p_cam.z();
      if (ray.head<2>().cwiseAbs().maxCoeff() > 0.4) continue;
      Vector3d error = draw(errors.sigma_px / kFocal_px);
      error.z() = 0;
      ControlSight& sight = point.sights.emplace_back();
      sight.frame_index = frame.frame_index;
      sight.image = std::to_string(frame.frame_index) + ".jpg";
      sight.ray_cam = ray + error;
      sight.focal_px = kFocal_px;
    }
  }
  return control;
}

std::vector<Vector3d> Places() {
  return {{5, 5, 0}, {55, 8, 1}, {50, 55, 0}, {8, 52, 3}, {30, 30, 0.5}, {20, 45, 2}};
}

TEST(GroundControl, IsExactWhereTheSurveyIs) {
  const auto result = EstimateGeoreference(Frames(), Survey(Places()), kSurveyOrigin, std::nullopt);
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  const Georeference& found = *result.georeference;
  EXPECT_TRUE(found.is_by_control);
  EXPECT_TRUE(found.has_altitude);
  EXPECT_NEAR(found.S_enu_map.scale() / 37, 1, 1e-7);
  for (const Vector3d& place : Places()) {
    EXPECT_LT((found.S_enu_map * (TrueSurveySimilarity().Inverse() * place) - place).norm(), 1e-5);
  }
  ASSERT_EQ(found.control.size(), 6U);
  for (const ControlResidual& residual : found.control) {
    EXPECT_TRUE(residual.is_used && residual.is_seen) << residual.name;
    EXPECT_LT(residual.enu_m.norm(), 1e-5);
    EXPECT_LT(residual.rms_px, 1e-3);
    EXPECT_EQ(residual.num_marks, residual.num_marks_used);
    EXPECT_GE(residual.num_marks, 4U);
  }
}

// Over 300 surveys: how often the truth lies within one stated standard deviation. 68 % of a normal
// distribution; 300 draws have 2.7 % of their own, and what scatters is estimated from 11 errors.
TEST(GroundControl, StatesHowSureItIs) {
  constexpr int kSurveys = 300;
  int num_scale = 0, num_heading = 0, num_place = 0;
  for (int i = 0; i < kSurveys; ++i) {
    const auto result =
        EstimateGeoreference(Frames(), Survey(Places(), {0.03, 1, static_cast<unsigned>(i)}),
                             kSurveyOrigin, std::nullopt);
    ASSERT_TRUE(result.georeference.has_value()) << result.reason;
    const Georeference& found = *result.georeference;
    const Similarity error = found.S_enu_map * TrueSurveySimilarity().Inverse();
    num_scale += std::abs(std::log(error.scale())) < found.scale_sigma ? 1 : 0;
    num_heading +=
        std::abs(RotationLog(error.pose().rotation()).z()) < found.heading_sigma_rad ? 1 : 0;
    const Vector3d middle(28, 32.5, 1.08);
    num_place += std::abs((error * middle - middle).x()) < found.position_sigma_m.x() ? 1 : 0;
  }
  for (const int num : {num_scale, num_heading, num_place}) {
    EXPECT_GE(num, 0.60 * kSurveys);
    EXPECT_LE(num, 0.78 * kSurveys);
  }
}

// Lines of 30 ms in all, at 12 m/s and turning: the ground moves by 7 pixels meanwhile.
TEST(GroundControl, TakesEachMarkByThePoseOfItsLine) {
  const Similarity S_map_enu = TrueSurveySimilarity().Inverse();
  constexpr double kReadout_s = 0.03;
  std::vector<FrameInMap> frames = Frames();
  for (FrameInMap& frame : frames) {
    frame.velocity.linear_su_per_s = Vector3d(12, -4, 1) * S_map_enu.scale();
    frame.velocity.angular_rad_per_s = {0.1, -0.2, 0.3};
    frame.velocity.angular_rad_per_s2 = {1, 2, -1};
  }
  GroundControl control = Survey(Places());
  for (std::size_t i = 0; i < control.points.size(); ++i) {
    for (ControlSight& sight : control.points[i].sights) {
      const FrameInMap& frame = frames[static_cast<std::size_t>(sight.frame_index)];
      const Vector3d p_cam = frame.T_map_cam.Inverse() * (S_map_enu * Places()[i]);
      // Rows of 800 pixels; which one shows the point depends on where that is by then.
      Vector3d ray = p_cam / p_cam.z();
      for (int round = 0; round < 6; ++round) {
        sight.line_s = kReadout_s * ray.y() / 0.8;
        const Vector3d p_line = frame.velocity.T_later_now(sight.line_s) * p_cam;
        ray = p_line / p_line.z();
      }
      sight.ray_cam = ray;
    }
  }
  const auto result = EstimateGeoreference(frames, control, kSurveyOrigin, std::nullopt);
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  const auto known = KnownPointsOf(frames, control, *result.georeference);
  ASSERT_EQ(known.size(), 6U);
  double most_moved_px = 0;
  for (std::size_t i = 0; i < known.size(); ++i) {
    const ControlResidual& residual = result.georeference->control[i];
    EXPECT_LT(residual.enu_m.norm(), 1e-5);
    EXPECT_LT(residual.rms_px, 1e-3);
    EXPECT_EQ(residual.num_marks_used, residual.num_marks);
    // What follows the points knows poses of middle lines alone.
    for (std::size_t k = 0; k < known[i].sights.size(); ++k) {
      const PointSight& sight = known[i].sights[k];
      const FrameInMap& frame = frames[static_cast<std::size_t>(sight.frame_index)];
      const Vector3d p_cam = frame.T_map_cam.Inverse() * (S_map_enu * Places()[i]);
      EXPECT_LT((sight.ray_cam - p_cam / p_cam.z()).norm(), 1e-6);
      const Vector3d moved = sight.ray_cam - control.points[i].sights[k].ray_cam;
      most_moved_px = std::max(most_moved_px, kFocal_px * moved.norm());
    }
  }
  EXPECT_GT(most_moved_px, 2);

  // By the poses of the middle lines they are off.
  for (FrameInMap& frame : frames) frame.velocity = {};
  const auto middle = EstimateGeoreference(frames, control, kSurveyOrigin, std::nullopt);
  ASSERT_TRUE(middle.georeference.has_value()) << middle.reason;
  EXPECT_GT(middle.georeference->control[0].rms_px, 0.5);
}

TEST(GroundControl, NamesAMarkThatWasSetInTheWrongPlace) {
  GroundControl control = Survey(Places(), {0.01, 0.5, 3});
  control.points[2].sights[1].ray_cam.y() += 40 / kFocal_px;
  const std::string image = control.points[2].sights[1].image;
  const auto result = EstimateGeoreference(Frames(), control, kSurveyOrigin, std::nullopt);
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  const ControlResidual& residual = result.georeference->control[2];
  EXPECT_TRUE(residual.is_used);
  EXPECT_THAT(residual.contradicting_images, ElementsAre(image));
  EXPECT_EQ(residual.num_marks_used + 1, residual.num_marks);
  EXPECT_LT(residual.enu_m.norm(), 0.1);
  const auto known = KnownPointsOf(Frames(), control, *result.georeference);
  ASSERT_EQ(known.size(), 6U);
  EXPECT_EQ(known[2].sights.size(), residual.num_marks_used);
}

TEST(GroundControl, LeavesOutAPointThatContradictsAllOthers) {
  for (std::size_t wrong = 0; wrong < 6; ++wrong) {
    GroundControl control = Survey(Places(), {0.02, 0.5, 5});
    const Vector3d p = ToEnu(control.points[wrong].place, kSurveyOrigin);
    control.points[wrong].place = ToGeodetic(p + Vector3d(0.8, 0, 0.9), kSurveyOrigin);
    const auto result = EstimateGeoreference(Frames(), control, kSurveyOrigin, std::nullopt);
    ASSERT_TRUE(result.georeference.has_value()) << result.reason;
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_EQ(result.georeference->control[i].is_used, i != wrong) << wrong << " " << i;
    }
    EXPECT_THAT(result.georeference->control[wrong].why_unused, HasSubstr("contradicts"));
    EXPECT_NEAR(result.georeference->control[wrong].enu_m.x(), -0.8, 0.15);
    EXPECT_EQ(KnownPointsOf(Frames(), control, *result.georeference).size(), 5U);
  }
}

TEST(GroundControl, CheckPointsTakeNoPart) {
  GroundControl control = Survey(Places());
  control.points[4].is_check = true;
  const Vector3d p = ToEnu(control.points[4].place, kSurveyOrigin);
  control.points[4].place = ToGeodetic(p + Vector3d(0, 0.5, 0), kSurveyOrigin);
  const auto result = EstimateGeoreference(Frames(), control, kSurveyOrigin, std::nullopt);
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  const ControlResidual& check = result.georeference->control[4];
  EXPECT_FALSE(check.is_used);
  EXPECT_TRUE(check.is_check && check.is_seen && check.why_unused.empty());
  EXPECT_NEAR(check.enu_m.y(), -0.5, 1e-4);
  // Half a metre from 50 m away.
  EXPECT_NEAR(check.rms_px, 0.5 / 50 * kFocal_px, 1);
  EXPECT_NEAR(result.georeference->S_enu_map.scale() / 37, 1, 1e-7);
  EXPECT_EQ(KnownPointsOf(Frames(), control, *result.georeference).size(), 5U);
}

TEST(GroundControl, AHeightMayBeMissing) {
  GroundControl control = Survey(Places(), {0.01, 0.3, 2});
  control.points[1].has_height = false;
  control.points[1].place.altitude_m = 90;  // as if in the middle of nowhere
  const auto result = EstimateGeoreference(Frames(), control, kSurveyOrigin, std::nullopt);
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  EXPECT_TRUE(result.georeference->control[1].is_used);
  EXPECT_EQ(result.georeference->control[1].enu_m.z(), 0);
  EXPECT_NEAR(result.georeference->S_enu_map.scale() / 37, 1, 1e-3);
  EXPECT_EQ(KnownPointsOf(Frames(), control, *result.georeference)[1].sigma_m.z(), 0);
}

TEST(GroundControl, SaysWhatIsMissing) {
  const std::vector<FrameInMap> frames = Frames();
  const auto reason = [&](const GroundControl& control) {
    const auto result = EstimateGeoreference(frames, control, kSurveyOrigin, std::nullopt);
    EXPECT_FALSE(result.georeference.has_value());
    return result.reason;
  };
  EXPECT_THAT(reason(Survey({{5, 5, 0}, {50, 50, 0}})), HasSubstr("three needed"));
  GroundControl control = Survey({{5, 5, 0}, {50, 50, 0}, {5, 50, 0}});
  control.points[0].sights.resize(1);
  EXPECT_THAT(reason(control), HasSubstr("2 usable control points"));
  EXPECT_THAT(reason(Survey({{5, 5, 0}, {30, 30, 0}, {55, 55, 0}})), HasSubstr("line"));
}

// The roll about a line is what is known of up.
TEST(GroundControl, PointsOnALineNeedToKnowWhichWayIsUp) {
  const Vector3d up_map = TrueSurveySimilarity().pose().rotation().inverse() * Vector3d::UnitZ();
  const auto result = EstimateGeoreference(Frames(), Survey({{5, 5, 0}, {30, 30, 0}, {55, 55, 0}}),
                                           kSurveyOrigin, UpDirection{up_map, 0.02});
  ASSERT_TRUE(result.georeference.has_value()) << result.reason;
  const Similarity error = result.georeference->S_enu_map * TrueSurveySimilarity().Inverse();
  EXPECT_LT(RotationLog(error.pose().rotation()).norm(), 1e-4);
  EXPECT_NEAR(result.georeference->tilt_sigma_rad, 0.02, 0.01);
}

TEST(GroundControl, ShowsHowFarAMapIsOffThatItDidNotPlace) {
  Georeference elsewhere;
  elsewhere.origin = kSurveyOrigin;
  elsewhere.S_enu_map = Similarity(1, Pose(Eigen::Quaterniond::Identity(), Vector3d(2, 0, -1))) *
                        TrueSurveySimilarity();
  const auto residuals = ControlResidualsOf(Frames(), Survey(Places()), elsewhere);
  ASSERT_EQ(residuals.size(), 6U);
  for (const ControlResidual& residual : residuals) {
    EXPECT_FALSE(residual.is_used);
    EXPECT_LT((residual.enu_m - Vector3d(2, 0, -1)).norm(), 1e-4);
  }
}

}  // namespace
}  // namespace mono3d
