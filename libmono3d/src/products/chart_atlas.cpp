// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/chart_atlas.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// Legs of the right triangle that takes the colours of the corners where there is no view.
constexpr float kUnseenLegs_px = 2;

struct Chart {
  std::vector<std::uint32_t> triangles;
  std::uint32_t view = kNoView;
  // In the pixels of the view.
  Eigen::Vector2f lowest = Eigen::Vector2f::Zero();
  Eigen::Vector2f highest = Eigen::Vector2f::Zero();

  // Of its place in a texture.
  cv::Size SizeAt(double scale) const {
    const Eigen::Vector2f extent = (highest - lowest) * static_cast<float>(scale);
    return {static_cast<int>(std::ceil(extent.x())) + 2 * kGutter_px + 1,
            static_cast<int>(std::ceil(extent.y())) + 2 * kGutter_px + 1};
  }
};

std::array<Eigen::Vector2f, 3> PixelsIn(const Chart& chart, const TriangleMesh& mesh,
                                        std::span<const PinholeView> views,
                                        std::uint32_t triangle) {
  if (chart.view == kNoView) {
    return {Eigen::Vector2f(0, 0), Eigen::Vector2f(kUnseenLegs_px, 0),
            Eigen::Vector2f(0, kUnseenLegs_px)};
  }
  std::array<Eigen::Vector2f, 3> pixels;
  for (std::size_t k = 0; k < 3; ++k) {
    pixels.at(k) = views[chart.view].Pixel(mesh.vertices[mesh.triangles[triangle].at(k)]);
  }
  return pixels;
}

std::vector<Chart> FindCharts(const TriangleMesh& mesh, const std::vector<std::uint32_t>& chosen,
                              const TriangleNeighbours& neighbours,
                              std::span<const PinholeView> views) {
  std::vector<Chart> charts;
  std::vector<bool> is_taken(chosen.size(), false);
  for (std::uint32_t seed = 0; seed < chosen.size(); ++seed) {
    if (is_taken[seed]) continue;
    is_taken[seed] = true;
    Chart chart{.triangles = {seed}, .view = chosen[seed]};
    for (std::size_t i = 0; chart.view != kNoView && i < chart.triangles.size(); ++i) {
      for (const std::uint32_t next : neighbours[chart.triangles[i]]) {
        if (next == kNoTriangle || is_taken[next] || chosen[next] != chart.view) continue;
        is_taken[next] = true;
        chart.triangles.push_back(next);
      }
    }
    chart.lowest = chart.highest = PixelsIn(chart, mesh, views, seed)[0];
    for (const std::uint32_t triangle : chart.triangles) {
      for (const Eigen::Vector2f& pixel : PixelsIn(chart, mesh, views, triangle)) {
        chart.lowest = chart.lowest.cwiseMin(pixel);
        chart.highest = chart.highest.cwiseMax(pixel);
      }
    }
    // Whole pixels: texels then are pixels of the view, and none is made of four.
    chart.lowest = chart.lowest.array().floor();
    charts.push_back(std::move(chart));
  }
  return charts;
}

struct Place {
  std::uint32_t texture = 0;
  cv::Point corner;  // top left
};

// Rectangles in rows, the highest first, each in the first row that has room.
class Shelves {
 public:
  Shelves(int height_px, int width_px, int max_textures)
      : height_px_(height_px), width_px_(width_px), max_textures_(max_textures) {}

  std::optional<Place> Add(const cv::Size& size) {
    if (size.width > width_px_ || size.height > height_px_) return std::nullopt;
    // Rows that are full stay so for all that is as wide; few are open at a time.
    for (Row& row : open_) {
      if (row.place.corner.x + size.width > width_px_ || size.height > row.height) continue;
      return Take(row, size);
    }
    if (top_ + size.height > height_px_) {
      ++texture_;
      top_ = 0;
    }
    if (texture_ >= max_textures_) return std::nullopt;
    constexpr std::size_t kMostOpen = 16;
    if (open_.size() >= kMostOpen) open_.erase(open_.begin());
    open_.push_back({{static_cast<std::uint32_t>(texture_), {0, top_}}, size.height});
    top_ += size.height;
    return Take(open_.back(), size);
  }

  const std::vector<cv::Size>& used() const { return used_; }

 private:
  struct Row {
    Place place;
    int height = 0;
  };

  Place Take(Row& row, const cv::Size& size) {
    const Place place = row.place;
    row.place.corner.x += size.width;
    if (used_.size() <= place.texture) used_.resize(place.texture + 1);
    cv::Size& used = used_[place.texture];
    used.width = std::max(used.width, row.place.corner.x);
    used.height = std::max(used.height, place.corner.y + size.height);
    return place;
  }

  int height_px_;
  int width_px_;
  int max_textures_;
  int texture_ = 0;
  int top_ = 0;
  std::vector<Row> open_;
  std::vector<cv::Size> used_;
};

struct Packing {
  std::vector<Place> places;  // of each chart
  std::vector<cv::Size> textures;
};

// Nothing: they do not fit.
std::optional<Packing> PackAt(double scale, const std::vector<Chart>& charts, int side_px,
                              int max_textures) {
  std::vector<cv::Size> sizes;
  double area = 0;
  int widest = 1;
  for (const Chart& chart : charts) {
    sizes.push_back(chart.SizeAt(chart.view == kNoView ? 1 : scale));
    area += sizes.back().area();
    widest = std::max(widest, sizes.back().width);
  }
  // What needs less than a texture gets a square one.
  const int square = static_cast<int>(std::ceil(std::sqrt(area)));
  Shelves shelves(side_px, std::min(side_px, std::max(square, widest)), max_textures);
  std::vector<std::size_t> order(charts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    return sizes[a].height != sizes[b].height ? sizes[a].height > sizes[b].height
                                              : sizes[a].width > sizes[b].width;
  });
  Packing packing;
  packing.places.resize(charts.size());
  for (const std::size_t chart : order) {
    const auto place = shelves.Add(sizes[chart]);
    if (!place) return std::nullopt;
    packing.places[chart] = *place;
  }
  packing.textures = shelves.used();
  return packing;
}

}  // namespace

ChartAtlas PackCharts(const TriangleMesh& mesh, const std::vector<std::uint32_t>& chosen,
                      const TriangleNeighbours& neighbours, std::span<const PinholeView> views,
                      int side_px, int max_textures) {
  const std::vector<Chart> charts = FindCharts(mesh, chosen, neighbours, views);
  // A tenth at a time: finer steps would take longer than they save.
  constexpr double kStep = .9;
  constexpr double kSmallest = .01;
  double scale = 1;
  std::optional<Packing> packing = PackAt(scale, charts, side_px, max_textures);
  while (!packing && scale > kSmallest) {
    scale *= kStep;
    packing = PackAt(scale, charts, side_px, max_textures);
  }
  if (!packing) {
    throw Error(ErrorParts{.what = "the textures have no room for the triangles, take fewer",
                           .where = "mesh",
                           .expected = std::to_string(max_textures) + " textures of " +
                                       std::to_string(side_px) + " px at most",
                           .found = std::to_string(charts.size()) + " pieces of images",
                           .code = ErrorCode::kInvalidArgument});
  }
  ChartAtlas atlas;
  atlas.num_charts = charts.size();
  atlas.textures = packing->textures;
  atlas.texels_per_pixel = scale;
  atlas.chart.resize(mesh.triangles.size());
  atlas.texture.resize(mesh.triangles.size());
  atlas.texels.resize(mesh.triangles.size());
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const Place& place = packing->places[i];
    const Eigen::Vector2f corner(static_cast<float>(place.corner.x + kGutter_px),
                                 static_cast<float>(place.corner.y + kGutter_px));
    const float chart_scale = charts[i].view == kNoView ? 1 : static_cast<float>(scale);
    for (const std::uint32_t triangle : charts[i].triangles) {
      atlas.chart[triangle] = static_cast<std::uint32_t>(i);
      atlas.texture[triangle] = place.texture;
      auto pixels = PixelsIn(charts[i], mesh, views, triangle);
      for (std::size_t k = 0; k < 3; ++k) {
        atlas.texels[triangle].at(k) = corner + chart_scale * (pixels.at(k) - charts[i].lowest);
      }
    }
  }
  return atlas;
}

}  // namespace mono3d
