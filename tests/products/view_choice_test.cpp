// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/view_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "products/view_shares.h"

namespace mono3d {
namespace {

// Triangles in a row, each beside the next.
TriangleMesh Strip(std::uint32_t num_triangles) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < num_triangles + 2; ++i) {
    mesh.vertices.emplace_back(static_cast<float>(i / 2), static_cast<float>(i % 2), 0.F);
    mesh.colours.push_back({100, 100, 100});
  }
  for (std::uint32_t i = 0; i < num_triangles; ++i) {
    mesh.triangles.push_back(i % 2 == 0 ? std::array{i, i + 2, i + 1}
                                        : std::array{i, i + 1, i + 2});
  }
  return mesh;
}

TriangleView SeenAs(std::uint32_t view, float area_px, std::uint8_t grey, bool is_clear = true) {
  return {.view = view, .area_px = area_px, .colour = {grey, grey, grey}, .is_clear = is_clear};
}

TEST(FindNeighbours, AreThoseWithACommonEdge) {
  const TriangleNeighbours neighbours = FindNeighbours(Strip(3));
  EXPECT_EQ(std::ranges::count(neighbours[0], kNoTriangle), 2);
  EXPECT_EQ(std::ranges::count(neighbours[0], 1u), 1);
  EXPECT_EQ(std::ranges::count(neighbours[1], 0u), 1);
  EXPECT_EQ(std::ranges::count(neighbours[1], 2u), 1);
}

TEST(FindNeighbours, AreNoneAtAnEdgeOfThree) {
  TriangleMesh mesh = Strip(2);
  mesh.vertices.emplace_back(0, 0, 1);
  mesh.triangles.push_back({1, 2, 4});  // the edge that the first two share
  for (const auto& of : FindNeighbours(mesh)) EXPECT_EQ(std::ranges::count(of, kNoTriangle), 3);
}

TEST(TriangleViews, KeepTheLargestOfThoseThatAreClear) {
  TriangleViews views(1);
  for (std::uint32_t i = 0; i < 20; ++i) {
    views.Add(0, SeenAs(i, static_cast<float>((i * 7) % 20), 100));
  }
  const auto of = views.Of(0);
  ASSERT_EQ(of.size(), TriangleViews::kMost);
  for (std::size_t i = 0; i < of.size(); ++i) {
    EXPECT_EQ(of[i].area_px, static_cast<float>(19 - i));
  }
  views.Add(0, SeenAs(30, 1000, 100, false));  // larger, but not clear
  EXPECT_EQ(views.Find(0, 30), of.size());

  TriangleViews hidden(1);
  hidden.Add(0, SeenAs(0, 50, 100, false));
  hidden.Add(0, SeenAs(1, 60, 100, false));
  hidden.DropUnclear();
  EXPECT_EQ(hidden.Of(0).size(), 2u);
  hidden.Add(0, SeenAs(2, 1, 100));
  hidden.DropUnclear();
  ASSERT_EQ(hidden.Of(0).size(), 1u);
  EXPECT_EQ(hidden.Of(0)[0].view, 2u);
}

TEST(TriangleViews, DropThoseThatDisagree) {
  TriangleViews views(2);
  const std::vector<Eigen::Vector3f> gains(6, Eigen::Vector3f::Ones());
  const std::array<std::uint8_t, 5> greys = {100, 104, 200, 98, 101};
  for (std::uint32_t i = 0; i < 5; ++i) views.Add(0, SeenAs(i, 10, greys.at(i)));
  views.Add(1, SeenAs(0, 10, 100));
  views.Add(1, SeenAs(1, 10, 200));  // of two nobody knows which
  views.DropOutliers(gains);
  EXPECT_EQ(views.Of(0).size(), 4u);
  EXPECT_EQ(views.Find(0, 2), 4u);
  EXPECT_EQ(views.Of(1).size(), 2u);
}

TEST(EstimateGains, FindsExposuresDespiteOutliers) {
  const TriangleMesh mesh = Strip(200);  // grey 100 everywhere
  const std::array<float, 3> exposures = {.8F, 1.F, 1.25F};
  TriangleViews views(200);
  for (std::size_t i = 0; i < 200; ++i) {
    for (std::uint32_t view = 0; view < 3; ++view) {
      const float grey = i % 10 == 0 && view == 1 ? 220 : 100 * exposures.at(view);
      views.Add(i, SeenAs(view, 10, static_cast<std::uint8_t>(std::lround(grey))));
    }
  }
  const auto gains = EstimateGains(mesh, views, 3);
  ASSERT_EQ(gains.size(), 4u);
  for (std::size_t view = 0; view < 3; ++view) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(gains[view][c], 1 / exposures.at(view), .01);
  }
}

TEST(ChooseViews, PrefersLargePiecesToSlightlyBetterViews) {
  TriangleViews views(100);
  for (std::uint32_t i = 0; i < 100; ++i) {
    views.Add(i, SeenAs(i % 2, 11, 100));
    views.Add(i, SeenAs(1 - i % 2, 10, 100));
  }
  const auto chosen = ChooseViews(views, FindNeighbours(Strip(100)));
  EXPECT_EQ(std::set(chosen.begin(), chosen.end()).size(), 1u);
}

TEST(ChooseViews, TakesTheBetterViewOfEachPart) {
  TriangleViews views(101);
  for (std::uint32_t i = 0; i < 100; ++i) {  // the last one nobody sees
    views.Add(i, SeenAs(0, i < 50 ? 100 : 20, 100));
    views.Add(i, SeenAs(1, i < 50 ? 20 : 100, 100));
  }
  const auto chosen = ChooseViews(views, FindNeighbours(Strip(101)));
  for (std::uint32_t i = 0; i < 100; ++i) EXPECT_EQ(chosen[i], i < 50 ? 0u : 1u) << i;
  EXPECT_EQ(chosen[100], kNoView);
}

TEST(LevelSeams, MakesViewsAgreeWhereTheyMeet) {
  // View 1 is 20 levels brighter, and all that is known is where both see the strip.
  const TriangleMesh mesh = Strip(100);
  TriangleViews views(100);
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t i = 0; i < 100; ++i) {
    views.Add(i, SeenAs(0, 100, 100));
    views.Add(i, SeenAs(1, 100, 120));
    chosen.push_back(i < 50 ? 0 : 1);
  }
  ViewShares shares = ShareViews(mesh, views, chosen, 1);
  const std::vector<Eigen::Vector3f> gains(3, Eigen::Vector3f::Ones());
  LevelSeams(mesh, views, gains, shares);
  int num_meetings = 0;
  for (const auto& of : shares) {
    float sum = 0;
    for (const ViewShare& share : of) sum += share.share;
    EXPECT_NEAR(sum, 1, 1e-5);
    if (of.size() < 2) continue;
    ++num_meetings;
    const auto colour = [&](const ViewShare& share) {
      return (share.view == 0 ? 100 : 120) + share.adjustment[0];
    };
    EXPECT_NEAR(colour(of[0]), colour(of[1]), 4);
  }
  EXPECT_GE(num_meetings, 3);
  EXPECT_EQ(shares[0].size(), 1u);  // far from the seam
}

}  // namespace
}  // namespace mono3d
