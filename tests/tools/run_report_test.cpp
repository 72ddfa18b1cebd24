// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The page that every run leaves.

#include "run_report/run_report.h"

#include <expat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "mono3d/geometry/geodetic.h"
#include "run_report/even_sample.h"
#include "run_report/lost_frames.h"
#include "run_report/model_drawing.h"
#include "run_report/model_view.h"
#include "run_report/next_views_kml.h"
#include "run_report/next_views_report.h"
#include "run_report/overlap.h"
#include "run_report/run_sections.h"
#include "run_report/timeline.h"
#include "tools/command.h"

namespace mono3d::tools {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(EvenSample, KeepsElementsAtEqualDistancesHoweverManyCome) {
  EvenSample<int> sample(8);
  for (int i = 0; i < 100; ++i) {
    if (sample.TakesNext()) sample.Add(i);
  }
  EXPECT_THAT(sample.elements(), ElementsAre(0, 16, 32, 48, 64, 80, 96));
}

void AddFrame(std::int64_t index, const std::string& reason, RunNotes& notes) {
  Frame frame;
  frame.index = index;
  frame.name = "image " + std::to_string(index);
  frame.bgr = cv::Mat(60, 80, CV_8UC3, cv::Scalar(20, 30, 40));
  notes.AddImage(frame);
  const PipelineCounts counts;
  const ModelHealth health;
  TrackingResult tracking;
  tracking.status = reason.empty() ? TrackingStatus::kTracking : TrackingStatus::kLost;
  tracking.reason = reason;
  notes.AddProgress(
      {.counts = counts, .tracking = tracking, .health = health, .frame_index = index});
}

// Frames 0 to 9: 0 has its pose later, 3 to 5 and 8 have none.
void AddFlight(RunNotes& notes, Reconstruction& reconstruction) {
  reconstruction.maps.resize(1);
  for (int i = 0; i < 10; ++i) {
    const bool is_lost = (i >= 3 && i < 6) || i == 8;
    AddFrame(i, is_lost ? "12 features, 50 needed" : i == 0 ? "first view" : "", notes);
    if (is_lost) continue;
    TrajectoryEntry entry;
    entry.frame_index = i;
    entry.T_world_cam = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.5 * i - 2, 0, -4));
    reconstruction.maps[0].trajectory.push_back(entry);
  }
}

// A red square of 101x101 surfels, 4 su wide, that looks towards -z.
PointCloud Square() {
  PointCloud cloud;
  for (int i = 0; i < 101 * 101; ++i) {
    cloud.points.emplace_back(0.04F * static_cast<float>(i % 101) - 2,
                              0.04F * static_cast<float>(i / 101) - 2, 0.0F);
    cloud.normals.emplace_back(0.0F, 0.0F, -1.0F);
    cloud.colours.push_back({200, 10, 10});
    cloud.radii.push_back(0.03F);
    cloud.confidences.push_back(1);
    cloud.observations.push_back(3);
  }
  return cloud;
}

TEST(LostFrames, AreStretchesWithTheirReasonTheLongestFirst) {
  RunNotes notes;
  Reconstruction reconstruction;
  AddFlight(notes, reconstruction);
  const std::vector<FrameOutcome> outcomes = FrameOutcomes(notes.frames(), reconstruction);
  ASSERT_EQ(outcomes.size(), 10U);
  EXPECT_EQ(outcomes[0].fate, FrameFate::kRecovered);
  EXPECT_EQ(outcomes[1].fate, FrameFate::kTracked);
  const std::vector<LostStretch> stretches = LostStretches(outcomes);
  ASSERT_EQ(stretches.size(), 2U);
  EXPECT_EQ(stretches[0].first_frame, 3);
  EXPECT_EQ(stretches[0].last_frame, 5);
  EXPECT_EQ(stretches[0].num_frames, 3);
  EXPECT_EQ(stretches[0].reason, "12 features, 50 needed");
  EXPECT_EQ(stretches[1].first_frame, 8);
}

// They are looked at at the end: none of them came "later".
TEST(LostFrames, OfPhotographsAreThoseWithoutAPlace) {
  RunNotes notes;
  Reconstruction reconstruction;
  reconstruction.maps.resize(1);
  const PipelineCounts counts;
  const ModelHealth health;
  TrackingResult pending;
  pending.is_pending = true;
  pending.reason = "photos are placed together, at the end";
  reconstruction.unplaced_photos[2] = "no other photo shows the same";
  reconstruction.unplaced_photos[3] = "12 features, 30 are needed";
  for (int i = 0; i < 4; ++i) {
    Frame photo;
    photo.index = i;
    photo.name = "DJI_" + std::to_string(i) + ".JPG";
    photo.bgr = cv::Mat(4, 6, CV_8UC3, cv::Scalar(1, 2, 3));
    notes.AddImage(photo);
    notes.AddProgress({.counts = counts, .tracking = pending, .health = health, .frame_index = i});
    if (i < 2) reconstruction.maps[0].trajectory.push_back({.frame_index = i, .T_world_cam = {}});
  }
  const std::vector<FrameOutcome> outcomes = FrameOutcomes(notes.frames(), reconstruction);
  EXPECT_EQ(outcomes.at(0).fate, FrameFate::kTracked);
  EXPECT_EQ(outcomes.at(2).fate, FrameFate::kLost);
  // The reason that the run told, and the name that is on the card; each for itself.
  EXPECT_EQ(outcomes.at(2).reason, "no other photo shows the same");
  EXPECT_EQ(notes.NameOf(2), "DJI_2.JPG");
  EXPECT_EQ(notes.NameOf(4), "frame 4");
  const std::vector<LostStretch> stretches = LostStretches(outcomes);
  ASSERT_EQ(stretches.size(), 2U);
  EXPECT_EQ(stretches[0].photo, "DJI_2.JPG");
  EXPECT_EQ(stretches[1].photo, "DJI_3.JPG");
  EXPECT_EQ(stretches[1].reason, "12 features, 30 are needed");
}

TEST(Overlap, IsTheShareOfPointsThatTheKeyframeBeforeShowsToo) {
  SparseModel sparse;
  for (int i = 0; i < 30; ++i) sparse.points.push_back({.p_world = {0.1 * i, 0, 10}});
  for (int image = 0; image < 2; ++image) {
    SparseImage one;
    one.id = 7 * image;
    one.T_world_cam = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.5 * image, 0, 0));
    for (std::size_t i = 0; i < 20; ++i) {
      SparseObservation observation;
      observation.point = i + static_cast<std::size_t>(10 * image);
      one.observations.push_back(observation);
    }
    sparse.images.push_back(one);
  }
  const std::vector<KeyframeOverlap> overlaps = Overlaps(sparse);
  ASSERT_EQ(overlaps.size(), 1U);
  EXPECT_EQ(overlaps[0].frame_index, 7);
  EXPECT_DOUBLE_EQ(overlaps[0].shared, 0.5);
  EXPECT_NEAR(overlaps[0].baseline_ratio, 0.05, 1e-12);
}

TEST(Overview, ShowsTheModelAndThePathAndSaysWhereThereIsNone) {
  RunNotes notes;
  Reconstruction reconstruction;
  const cv::Mat nothing = OverviewPicture(reconstruction, true);
  EXPECT_GT(cv::countNonZero(nothing.reshape(1) < 128), 100) << "words";
  AddFlight(notes, reconstruction);
  reconstruction.maps[0].model = Square();
  const cv::Mat picture = OverviewPicture(reconstruction, true);
  const auto share_of = [&](const cv::Scalar& low, const cv::Scalar& high) {
    cv::Mat mask;
    cv::inRange(picture, low, high, mask);
    return static_cast<double>(cv::countNonZero(mask)) / static_cast<double>(picture.total());
  };
  EXPECT_GT(share_of({10, 10, 200}, {10, 10, 200}), 0.3) << "the model, closed";
  EXPECT_GT(share_of({60, 150, 30}, {60, 150, 30}), 1e-4) << "the start";
}

// On the earth the unit is the metre, and y is north.
TEST(Overview, HasAScaleAndNorthOnTheEarthAlone) {
  RunNotes notes;
  Reconstruction reconstruction;
  AddFlight(notes, reconstruction);
  MapReconstruction& map = reconstruction.maps[0];
  map.model = Square();
  map.axes.source = AxesSource::kEarth;
  const cv::Mat without = OverviewPicture(reconstruction, true);
  map.georeference.emplace();
  const cv::Mat with = OverviewPicture(reconstruction, true);
  const CloudView view = ViewsOf(map.model, map, with.cols).front();
  cv::Mat difference;
  cv::absdiff(without, with, difference);
  cv::cvtColor(difference, difference, cv::COLOR_BGR2GRAY);
  const cv::Rect changed = cv::boundingRect(difference > 0);
  EXPECT_GT(changed.y, view.size.height - 60) << "in the corner of the view from above";
  EXPECT_LT(changed.br().x, view.size.width / 2);
  // The line from end to end is dark and of a round length: 1, 2 or 5 times a power of ten.
  const int row = view.size.height - 12;
  int length_px = 0;
  for (int x = 0; x < view.size.width / 2; ++x) {
    const auto bgr = with.at<cv::Vec3b>(row, x);
    if (bgr[0] < 100 && bgr[1] < 100 && bgr[2] < 100) ++length_px;
  }
  const double length_m = length_px * view.pixel_su;
  const double leading = length_m / std::pow(10, std::floor(std::log10(1.1 * length_m)));
  const double nearest = leading > 3.5 ? 5 : leading > 1.5 ? 2 : 1;
  // The marks at its ends are lines two pixels wide with round ends: up to four pixels more each.
  EXPECT_NEAR(leading, nearest, 8 * nearest / length_px) << length_m;
}

// A facade is thinnest across itself, and its normals do not tell up.
TEST(Overview, TakesUpFromTheAxesOfTheFiles) {
  MapReconstruction map;
  map.model = Square();  // in the plane of x and y: the ground, or a facade where z is ahead
  const auto down_of = [&] {
    return Eigen::Vector3d(ViewsOf(map.model, map, 300).front().R_view_world.row(2));
  };
  EXPECT_NEAR(down_of().z(), 1, 1e-6) << "against the normals, without any other hint";
  map.axes.source = AxesSource::kLevel;
  EXPECT_NEAR(down_of().z(), -1, 1e-6);
  for (Eigen::Vector3f& point : map.model.points) point = {point.x(), 0, point.y()};
  for (Eigen::Vector3f& normal : map.model.normals) normal = {0, -1, 0};
  EXPECT_NEAR(down_of().z(), -1, 1e-6) << "a facade";
}

TEST(NextViewsReport, ListsThemAndWritesTheirFile) {
  MapReconstruction map;
  map.model = Square();
  EXPECT_EQ(NextViewsSection(map, {}).title, "");
  NextViews next;
  next.surface_su2 = 16;
  EXPECT_THAT(NextViewsSection(map, next).paragraphs.at(0), HasSubstr("no further view"));
  NextView view;
  view.T_world_cam = Pose(Eigen::Quaterniond(0, 1, 0, 0), Eigen::Vector3d(1, 2, 3));
  view.target_world = {1, 2, 0};
  view.gain_su2 = {{ViewNeed::kThin, 4}, {ViewNeed::kHidden, 1}};
  next.views = {view};
  const Section section = NextViewsSection(map, next);
  ASSERT_EQ(section.tables.size(), 1U);
  EXPECT_THAT(section.tables[0].rows.at(0), ElementsAre("1", Explanation(ViewNeed::kThin), "31.2 %",
                                                        "1.00, 2.00, 3.00", "0.00, 0.00, -1.00"));
  cv::Mat arrow;
  cv::inRange(section.figures.at(0).image, cv::Scalar(160, 30, 150), cv::Scalar(160, 30, 150),
              arrow);
  EXPECT_GT(cv::countNonZero(arrow), 50);
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "mono3d_next_views_test";
  std::filesystem::create_directories(folder);
  WriteNextViews(folder, next);
  const nlohmann::json json = nlohmann::json::parse(ReadText(folder / "next_views.json"));
  std::filesystem::remove_all(folder);
  EXPECT_EQ(json["surface_su2"], 16);
  const nlohmann::json& first = json["views"].at(0);
  EXPECT_EQ(first["position"], nlohmann::json({1.0, 2.0, 3.0}));
  EXPECT_EQ(first["direction"].at(2), -1);
  EXPECT_EQ(first["target"], nlohmann::json({1.0, 2.0, 0.0}));
  EXPECT_EQ(first["rotation_xyzw"], nlohmann::json({1.0, 0.0, 0.0, 0.0}));
  EXPECT_EQ(first["reason"], "thin");
  EXPECT_EQ(first["gain_su2"], 5);
  EXPECT_EQ(first["gains_su2"]["hidden"], 1);
}

bool IsWellFormed(const std::string& xml) {
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(
      XML_ParserCreate(nullptr), &XML_ParserFree);
  return XML_Parse(parser.get(), xml.data(), static_cast<int>(xml.size()), 1) == XML_STATUS_OK;
}

// What stands between the first <name> and </name> from `from` on.
std::string TextOfElement(const std::string& xml, const std::string& name, std::size_t from = 0) {
  const std::size_t begin = xml.find("<" + name + ">", from) + name.size() + 2;
  return xml.substr(begin, xml.find("</" + name + ">", from) - begin);
}

// The places of a list of coordinates, "longitude,latitude,altitude" each.
std::vector<Geodetic> PlacesOf(const std::string& coordinates) {
  std::vector<Geodetic> places;
  std::istringstream words(coordinates);
  Geodetic place;
  char comma = 0;
  while (words >> place.longitude_deg >> comma >> place.latitude_deg >> comma >> place.altitude_m) {
    places.push_back(place);
  }
  return places;
}

// A camera at `p` that looks along `ahead`, its image upright towards `up`.
Pose Looking(const Eigen::Vector3d& p, const Eigen::Vector3d& ahead, const Eigen::Vector3d& up) {
  Eigen::Matrix3d R;
  R.col(2) = ahead;
  R.col(0) = ahead.cross(up);
  R.col(1) = R.col(2).cross(R.col(0));
  return Pose(Eigen::Quaterniond(R), p);
}

// On the earth, above a hill: the views are where they are in the model, seen from its origin.
TEST(NextViewsKml, HasTheViewsAndTheFlightOnTheEarth) {
  constexpr double kRounding_m = 0.01;  // of heights; the others have eight decimals
  MapReconstruction map;
  Georeference& georeference = map.georeference.emplace();
  georeference.origin = {.latitude_deg = -33.5, .longitude_deg = 151.25, .altitude_m = 160};
  georeference.has_altitude = true;
  georeference.position_sigma_m = {3, 4, 9};
  for (int i = 0; i < 5000; ++i) map.trajectory.push_back({.frame_index = i, .T_world_cam = {}});
  map.trajectory.back().T_world_cam = Pose(Eigen::Quaterniond::Identity(), {800, -300, 45});
  NextViews next;
  next.surface_su2 = 20;
  next.views.resize(2);
  next.views[0].T_world_cam = Looking({300, 40, 50}, {1, 0, 0}, {0, 0, 1});
  next.views[0].target_world = {350, 40, 50};
  next.views[0].gain_su2 = {{ViewNeed::kThin, 5}};
  // Straight down, with the south at the top of the image.
  next.views[1].T_world_cam = Looking({0, 0, 60}, {0, 0, -1}, {0, -1, 0});

  const std::string kml = NextViewsKml(map, next, /*is_path=*/true);
  ASSERT_TRUE(IsWellFormed(kml));
  EXPECT_THAT(kml, HasSubstr("a standard deviation of 5.0 m"));
  EXPECT_THAT(kml, Not(HasSubstr("relativeToGround")));
  const std::size_t first = kml.find("<name>1</name>"), second = kml.find("<name>2</name>");
  const std::vector<Geodetic> point = PlacesOf(TextOfElement(kml, "coordinates", first));
  ASSERT_EQ(point.size(), 1U);
  EXPECT_LT((ToEnu(point[0], georeference.origin) - Eigen::Vector3d(300, 40, 50)).norm(),
            kRounding_m);
  EXPECT_EQ(TextOfElement(kml, "heading", first), "90.00") << "east";
  EXPECT_EQ(TextOfElement(kml, "tilt", first), "90.00") << "level";
  EXPECT_THAT(TextOfElement(kml, "description", first),
              testing::StartsWith(std::string(Explanation(ViewNeed::kThin)) + "; gains 25.0 %"));
  const std::vector<Geodetic> arrow =
      PlacesOf(TextOfElement(kml, "coordinates", kml.find("<LineString>", first)));
  ASSERT_EQ(arrow.size(), 2U);
  EXPECT_LT((ToEnu(arrow[1], georeference.origin) - Eigen::Vector3d(350, 40, 50)).norm(),
            kRounding_m);
  EXPECT_EQ(TextOfElement(kml, "heading", second), "180.00") << "south";
  EXPECT_EQ(TextOfElement(kml, "tilt", second), "0.00") << "down";

  const std::size_t flight = kml.find("<name>The flight</name>");
  const std::vector<Geodetic> path = PlacesOf(TextOfElement(kml, "coordinates", flight));
  EXPECT_EQ(path.size(), 1667U) << "every third of 5000, so that there are 2000 at most";
  map.trajectory.erase(map.trajectory.begin(), map.trajectory.end() - 1);
  georeference.has_altitude = false;
  const std::string photos = NextViewsKml(map, next, /*is_path=*/false);
  ASSERT_TRUE(IsWellFormed(photos));
  EXPECT_THAT(photos, Not(HasSubstr("<altitudeMode>absolute")));
  const std::vector<Geodetic> photo =
      PlacesOf(TextOfElement(photos, "coordinates", photos.find("<name>The photographs</name>")));
  ASSERT_EQ(photo.size(), 1U);
  EXPECT_LT((ToEnu(photo[0], georeference.origin) - Eigen::Vector3d(800, -300, 45)).norm(),
            kRounding_m);
}

TEST(NextViewsKml, IsNotWrittenOfAMapThatIsNotOnTheEarth) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "mono3d_next_views_kml_test";
  std::filesystem::create_directories(folder);
  MapReconstruction map;
  WriteNextViewsKml(folder, map, {}, true);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  map.georeference.emplace();
  WriteNextViewsKml(folder, map, {}, true);
  EXPECT_TRUE(IsWellFormed(ReadText(folder / "next_views.kml")));
  std::filesystem::remove_all(folder);
}

TEST(ModelView, HoldsASampleOfTheSurfelsInTwelveBytesEach) {
  MapReconstruction map;
  EXPECT_EQ(ModelViewHtml(map, true), "");
  map.model = Square();
  const std::string html = ModelViewHtml(map, true, 1000);
  const std::string begin = "data-ratio=\"1000\">";
  const std::size_t first = html.find(begin) + begin.size();
  const std::size_t length = html.find("</script>", first) - first;
  const std::size_t num_surfels = (101 * 101 + 10) / 11;
  EXPECT_EQ(length, (num_surfels * 12 + 2) / 3 * 4);
  EXPECT_THAT(html, HasSubstr(std::to_string(num_surfels) + " of 10201 surfels"));
}

TEST(RunReport, TellsWhatWasLostAndWhyAndNeedsNoNetwork) {
  RunNotes notes;
  Reconstruction reconstruction;
  AddFlight(notes, reconstruction);
  reconstruction.maps[0].model = Square();
  reconstruction.maps[0].health.state = HealthState::kBroken;
  RunRecord record;
  record.input = "flight <1>";
  record.end = RunEnd::kStopped;
  record.camera = "camera.yaml";
  const RunReport report = {.reconstruction = reconstruction,
                            .record = record,
                            .notes = notes,
                            .command = "mono3d-reconstruct 'flight <1>'",
                            .no_model = "",
                            .warnings = {{"cannot read 3.jpg", 2}}};
  const std::string html = ToHtml(RunPage(report, OverviewPicture(reconstruction, true)));
  EXPECT_THAT(html, AllOf(HasSubstr("<title>flight &lt;1&gt;</title>"), HasSubstr("6 of 10"),
                          HasSubstr("stopped before the end"), HasSubstr("The model is broken"),
                          HasSubstr("Warning (2 times): cannot read 3.jpg"), HasSubstr("3 to 5"),
                          HasSubstr("12 features, 50 needed"), HasSubstr("too little structure"),
                          HasSubstr("was held")));
  EXPECT_THAT(html, AllOf(HasSubstr("mono3d-reconstruct 'flight &lt;1&gt;'"),
                          HasSubstr("id=\"lost_frames\""), HasSubstr("data:image/jpeg;base64,/9j/"),
                          HasSubstr("id=\"view3d\"")));
  EXPECT_THAT(html, AllOf(Not(HasSubstr("http:")), Not(HasSubstr("https:")),
                          Not(HasSubstr("src=\"/")), Not(HasSubstr("<link"))));
}

TEST(RunReport, CallsAModelGoodOnlyIfADepthMapWasComparedWithAnother) {
  const RunNotes notes;
  Reconstruction reconstruction;
  reconstruction.maps.resize(1);
  reconstruction.maps[0].model = Square();
  const auto of_model = [&] {
    const Page page = RunPage({.reconstruction = reconstruction,
                               .record = {},
                               .notes = notes,
                               .command = "",
                               .no_model = ""},
                              OverviewPicture(reconstruction, true));
    const auto figure = std::ranges::find(page.key_figures, "Model", &KeyFigure::label);
    return figure == page.key_figures.end() ? std::string() : figure->value;
  };
  EXPECT_EQ(of_model(), "unconfirmed");
  ModelHealth& health = reconstruction.maps[0].health;
  health.num_registrations = 1;
  EXPECT_EQ(of_model(), "good");
  health.num_registrations = 0;
  health.state = HealthState::kDegraded;
  EXPECT_EQ(of_model(), "degraded");
}

TEST(RunReport, HasTheNameOfTheFlight) {
  const RunNotes notes;
  const Reconstruction reconstruction;
  const auto title_of = [&](const std::string& input) {
    RunRecord record;
    record.input = input;
    return RunPage({.reconstruction = reconstruction,
                    .record = record,
                    .notes = notes,
                    .command = "",
                    .no_model = ""},
                   OverviewPicture(reconstruction, true))
        .title;
  };
  EXPECT_EQ(title_of("flights/monday.mp4"), "monday.mp4");
  EXPECT_EQ(title_of("flights/monday/"), "monday");
  EXPECT_EQ(title_of("flights/monday/images"), "monday");
  EXPECT_EQ(title_of("flights/monday/images/"), "monday");
  EXPECT_EQ(title_of("images"), "images");
}

// The state of the model over the frames, in the colours of the drawing.
TEST(RunReport, DrawsTheHealthOfTheModelOverTime) {
  RunNotes notes;
  Reconstruction reconstruction;
  AddFlight(notes, reconstruction);
  MapReconstruction& map = reconstruction.maps[0];
  map.fusions.resize(1);
  map.health_changes = {{.frame_index = 4, .state = HealthState::kDegraded, .reason = ""},
                        {.frame_index = 6, .state = HealthState::kBroken, .reason = ""},
                        {.frame_index = 8, .state = HealthState::kGood, .reason = ""}};
  const std::string svg =
      TimelineSvg(FrameOutcomes(notes.frames(), reconstruction), reconstruction);
  const auto width_of = [&](const char* state) {
    const std::size_t title = svg.find(std::string("<title>") + state + "</title>");
    if (title == std::string::npos) return 0.0;
    const std::size_t width = svg.rfind("width=\"", title) + 7;
    return std::stod(svg.substr(width));
  };
  EXPECT_THAT(svg, HasSubstr(">Model</text>"));
  EXPECT_NEAR(width_of("degraded"), width_of("broken"), 0.2);  // coordinates have one decimal
  EXPECT_NEAR(width_of("good"), 2 * width_of("broken"), 0.2) << "from the first frame on";
}

TEST(RunReport, TellsHowSureItIsWhereTheModelIsOnTheEarth) {
  const RunNotes notes;
  Reconstruction reconstruction;
  reconstruction.maps.resize(1);
  RunRecord record;
  const RunReport report = {.reconstruction = reconstruction,
                            .record = record,
                            .notes = notes,
                            .command = "",
                            .no_model = ""};
  const auto html = [&] { return ToHtml(RunPage(report, OverviewPicture(reconstruction, true))); };
  EXPECT_THAT(html(), Not(HasSubstr("On the earth")));
  reconstruction.maps[0].why_no_georeference = "3 of 9 fixes belong to a camera";
  EXPECT_THAT(html(), HasSubstr("not placed by them: 3 of 9 fixes belong to a camera."));
  Georeference& found = reconstruction.maps[0].georeference.emplace();
  found.origin = {.latitude_deg = 49.5, .longitude_deg = 8.25, .altitude_m = 160};
  found.scale_sigma = 0.0125;
  found.position_sigma_m = {0.25, 0.5, 1.75};
  found.clock_offset_s = 1.5;
  found.clock_offset_sigma_s = 0.25;
  found.num_used = 1;
  found.residuals = {{.fix = 0, .time_s = 1, .enu_m = {0.5, -0.25, 0}},
                     {.fix = 1, .time_s = 3, .enu_m = {40, 0, 0}, .is_outlier = true}};
  EXPECT_THAT(html(), AllOf(HasSubstr("49.5000000°, 8.2500000°"), HasSubstr("± 1.25 %"),
                            HasSubstr("± 0.25 m, ± 0.50 m, ± 1.75 m"), HasSubstr("1.50 ± 0.25 s"),
                            HasSubstr("1 of 2"), HasSubstr("fill=\"#c8382e\"")));
  // The outlier does not set the scale: half a metre is the end of it.
  EXPECT_THAT(html(), AllOf(HasSubstr(">0.5</text>"), Not(HasSubstr(">40</text>"))));
}

// Who reads the first section alone is told of a point that is metres off.
TEST(RunReport, SaysFirstWhichControlPointsContradict) {
  const RunNotes notes;
  Reconstruction reconstruction;
  Georeference& found = reconstruction.maps.emplace_back().georeference.emplace();
  found.is_by_control = true;
  ControlResidual good, bad;
  good.name = "gcp1";
  good.is_used = good.is_seen = true;
  bad.name = "gcp2";
  bad.why_unused = "it contradicts the other control points";
  bad.contradicting_images = {"7.jpg"};
  found.control = {good};
  const RunRecord record;
  const RunReport report = {.reconstruction = reconstruction,
                            .record = record,
                            .notes = notes,
                            .command = "",
                            .no_model = ""};
  EXPECT_EQ(NoticeSection(report).paragraphs.front(), "Nothing went wrong that the run knows of.");
  found.control = {good, bad};
  const std::vector<std::string> notices = NoticeSection(report).paragraphs;
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_EQ(notices[0],
            "Ground control point gcp2: it contradicts the other control points; its mark "
            "contradicts the others in 7.jpg. See below, On the earth.");
  const Table table = PositionSection(report).tables.at(1);
  EXPECT_EQ(table.rows.at(1).back(), "left out") << "short: a phone shows it beside the figures";
  EXPECT_THAT(table.notes.at(0), testing::StartsWith("gcp2: it contradicts"));
}

TEST(RunReport, IsWrittenWithoutAnyMap) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "mono3d_run_report_test";
  std::filesystem::create_directories(folder);
  const RunNotes notes;
  const Reconstruction reconstruction;
  RunRecord record;
  record.end = RunEnd::kFailed;
  record.error = "the disk is full";
  WriteRunReport(folder, {.reconstruction = reconstruction,
                          .record = record,
                          .notes = notes,
                          .command = "",
                          .no_model = "no model: tracking never started"});
  EXPECT_THAT(ReadText(folder / "report.html"),
              AllOf(HasSubstr("the disk is full"), HasSubstr("tracking never started"),
                    Not(HasSubstr("<canvas"))));
  EXPECT_THAT(ReadText(folder / "overview.png"), testing::StartsWith("\x89PNG"));
  std::filesystem::remove_all(folder);
}

TEST(RunReport, TakesTheFiguresOfAnEvaluationInPlaceOfEarlierOnes) {
  const RunNotes notes;
  const Reconstruction reconstruction;
  const RunRecord record;
  const std::string html = ToHtml(RunPage({.reconstruction = reconstruction,
                                           .record = record,
                                           .notes = notes,
                                           .command = "",
                                           .no_model = ""},
                                          OverviewPicture(reconstruction, true)));
  Page page;
  page.key_figures = {{"Depth L1-rel", "1.25 %", "first"}};
  page.sections.resize(1);
  page.sections[0].title = "Truth one";
  const std::string once = WithEvaluation(html, page);
  EXPECT_THAT(once, AllOf(HasSubstr("1.25 %"), HasSubstr("Truth one"), HasSubstr("The camera")));
  page.sections[0].title = "Truth two";
  const std::string twice = WithEvaluation(once, page);
  EXPECT_THAT(twice, AllOf(Not(HasSubstr("Truth one")), HasSubstr("Truth two")));
  EXPECT_EQ(twice.size(), once.size());
  EXPECT_EQ(WithEvaluation("<html></html>", page), "") << "not the page of a run";
}

TEST(ShellCommand, QuotesWhatAShellWouldTakeApart) {
  const std::vector<const char*> words = {"mono3d-reconstruct", "my flight/*.jpg", "-o", "it's"};
  EXPECT_EQ(ShellCommand(static_cast<int>(words.size()), words.data()),
            "mono3d-reconstruct 'my flight/*.jpg' -o 'it'\\''s'");
}

}  // namespace
}  // namespace mono3d::tools
