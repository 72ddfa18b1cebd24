// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/orthophoto.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>

#include "mono3d/core/error.h"
#include "products/height_window.h"
#include "products/image_cache.h"
#include "products/ortho_view.h"
#include "products/view_balance.h"

namespace mono3d {
namespace {

constexpr int kTile = 512;  // cells a side

// Views of nearly the same quality are mixed: down to this share of the best one. Between two
// neighbours that look straight down it is a strip of a tenth of the height wide, over which what
// is left of their differences goes from one to the other.
constexpr float kMixedShare = 0.9F;

// Views of less quality than this share of the best tell little of each other's exposure.
constexpr float kBalancedShare = 0.2F;

// How much surface around a tile may hide it, in cells of the surface, at most.
constexpr double kMaxMargin_cells = 1000;

// What of an image goes into a cell.
struct Tap {
  int cell = 0;  // of the tile, row by row
  Eigen::Vector2f pixel;
  float weight = 0;
  int level = 0;
};

struct ViewSight {
  std::size_t view = 0;
  OrthoView::Sight sight;
};

class Orthophoto {
 public:
  Orthophoto(const FinishedRun& run, const MapAxes& axes, const HeightSource& heights,
             const RasterGrid& grid)
      : axes_(axes), heights_(heights), grid_(grid), cache_(run.images) {
    for (const RunImage& image : run.images) {
      views_.emplace_back(image.camera, image.T_world_cam);
      eyes_.push_back(axes.ToMap(image.T_world_cam.translation()));
    }
    gains_.assign(views_.size(), cv::Vec3f(1, 1, 1));
    margin_ = MarginOf(heights);
  }

  void Balance();
  void Render(const RasterSink& sink);

 private:
  struct Tile {
    cv::Rect place;
    HeightWindow window;
    std::vector<std::size_t> views;   // that may see it
    std::vector<AffineMap> to_model;  // of its parts, row by row
    int parts_per_row = 0;
  };

  static double MarginOf(const HeightSource& heights);
  std::optional<Tile> MakeTile(const cv::Rect& place) const;
  template <typename Function>
  void ForEachTile(const Function& function);
  // The views that show the place and from which it is not hidden, the best one first, down to a
  // share of its quality.
  void FindSights(const Tile& tile, int column, int row, float share,
                  std::vector<ViewSight>& sights) const;
  int LevelOf(const ViewSight& sight, const Eigen::Vector3d& p_model) const;
  Eigen::Vector3d ModelPlace(const Tile& tile, int column, int row, float height) const;
  float HeightAt(const Tile& tile, int column, int row) const {
    return tile.window.At(grid_.ToMap(tile.place.x + column, tile.place.y + row));
  }
  void TakeSamples(const Tile& tile, int step, std::vector<ColourSample>& samples,
                   std::size_t& num_places);
  cv::Mat Draw(const Tile& tile);

  const MapAxes& axes_;
  const HeightSource& heights_;
  RasterGrid grid_;
  std::vector<OrthoView> views_;
  std::vector<Eigen::Vector3d> eyes_;  // on the map
  std::vector<cv::Vec3f> gains_;
  ImageCache cache_;
  double margin_ = 0;  // units of the map
};

constexpr int kPart = 64;  // cells a side, of which one affine map holds

double Orthophoto::MarginOf(const HeightSource& heights) {
  constexpr int kRowsAtOnce = 256;
  float lowest = 0, highest = 0;
  bool is_first = true;
  for (int row = 0; row < heights.grid.height; row += kRowsAtOnce) {
    const int num_rows = std::min(kRowsAtOnce, heights.grid.height - row);
    const cv::Mat part = heights.read({0, row, heights.grid.width, num_rows});
    for (int y = 0; y < part.rows; ++y) {
      for (int x = 0; x < part.cols; ++x) {
        const float height = part.at<float>(y, x);
        if (height == kNoHeight) continue;
        lowest = is_first ? height : std::min(lowest, height);
        highest = is_first ? height : std::max(highest, height);
        is_first = false;
      }
    }
  }
  // Views flatter than 60 degrees off the vertical are seldom the best.
  const double relief = highest - lowest;
  return std::min(std::sqrt(3.0) * relief, kMaxMargin_cells * heights.grid.cell);
}

std::optional<Orthophoto::Tile> Orthophoto::MakeTile(const cv::Rect& place) const {
  const Eigen::Vector2d north_west = grid_.ToMap(place.x - 0.5, place.y - 0.5);
  const Eigen::Vector2d south_east =
      grid_.ToMap(place.x + place.width - 0.5, place.y + place.height - 0.5);
  const Eigen::AlignedBox2d part(Eigen::Vector2d(north_west.x(), south_east.y()),
                                 Eigen::Vector2d(south_east.x(), north_west.y()));
  const HeightWindow own(heights_, part, 0);
  if (own.IsEmpty()) return std::nullopt;
  Tile tile{
      .place = place, .window = HeightWindow(heights_, part, margin_), .views = {}, .to_model = {}};
  const double middle = 0.5 * (own.lowest() + own.highest());
  const Eigen::Vector3d centre = axes_.ToModel({part.center().x(), part.center().y(), middle});
  const Eigen::Vector3d corner =
      axes_.ToModel({part.min().x(), part.min().y(), static_cast<double>(own.lowest())});
  const double radius = (corner - centre).norm() + 2 * grid_.cell * axes_.ModelUnitsPerUnit();
  for (std::size_t view = 0; view < views_.size(); ++view) {
    if (views_[view].MaySee(centre, radius)) tile.views.push_back(view);
  }
  tile.parts_per_row = (place.width + kPart - 1) / kPart;
  for (int row = 0; row < place.height; row += kPart) {
    for (int column = 0; column < place.width; column += kPart) {
      const Eigen::Vector2d at =
          grid_.ToMap(place.x + column + 0.5 * kPart, place.y + row + 0.5 * kPart);
      tile.to_model.push_back(axes_.ToModelNear({at.x(), at.y(), middle}));
    }
  }
  return tile;
}

template <typename Function>
void Orthophoto::ForEachTile(const Function& function) {
  for (int row = 0; row < grid_.height; row += kTile) {
    for (int column = 0; column < grid_.width; column += kTile) {
      const cv::Rect place(column, row, std::min(kTile, grid_.width - column),
                           std::min(kTile, grid_.height - row));
      function(place, MakeTile(place));
    }
  }
}

Eigen::Vector3d Orthophoto::ModelPlace(const Tile& tile, int column, int row, float height) const {
  const Eigen::Vector2d place = grid_.ToMap(tile.place.x + column, tile.place.y + row);
  const AffineMap& to_model =
      tile.to_model[static_cast<std::size_t>(row / kPart * tile.parts_per_row + column / kPart)];
  return to_model({place.x(), place.y(), static_cast<double>(height)});
}

void Orthophoto::FindSights(const Tile& tile, int column, int row, float share,
                            std::vector<ViewSight>& sights) const {
  sights.clear();
  const float height = HeightAt(tile, column, row);
  if (height == kNoHeight) return;
  const Eigen::Vector3d p_model = ModelPlace(tile, column, row, height);
  for (const std::size_t view : tile.views) {
    if (const auto sight = views_[view].See(p_model)) sights.push_back({view, *sight});
  }
  std::ranges::sort(sights, std::ranges::greater(),
                    [](const ViewSight& sight) { return sight.sight.quality; });
  const Eigen::Vector2d place = grid_.ToMap(tile.place.x + column, tile.place.y + row);
  const Eigen::Vector3d p_map(place.x(), place.y(), static_cast<double>(height));
  std::size_t num_seen = 0;
  for (const ViewSight& sight : sights) {
    if (num_seen > 0 && sight.sight.quality < share * sights[0].sight.quality) break;
    if (tile.window.IsHidden(p_map, eyes_[sight.view])) continue;
    sights[num_seen++] = sight;
  }
  sights.resize(num_seen);
}

int Orthophoto::LevelOf(const ViewSight& sight, const Eigen::Vector3d& p_model) const {
  const double pixels =
      views_[sight.view].PixelsPer(grid_.cell * axes_.ModelUnitsPerUnit(), p_model);
  return std::max(0, static_cast<int>(std::lround(std::log2(pixels))));
}

void Orthophoto::TakeSamples(const Tile& tile, int step, std::vector<ColourSample>& samples,
                             std::size_t& num_places) {
  // Means over four cells: poses are not exact to a pixel.
  constexpr int kMoreLevels = 2;
  struct Place {
    std::size_t index;
    Tap tap;
  };
  std::vector<std::vector<Place>> places(views_.size());
  std::vector<ViewSight> sights;
  const int first_row = (step - tile.place.y % step) % step;
  const int first_column = (step - tile.place.x % step) % step;
  for (int row = first_row; row < tile.place.height; row += step) {
    for (int column = first_column; column < tile.place.width; column += step) {
      FindSights(tile, column, row, kBalancedShare, sights);
      if (sights.size() < 2) continue;
      const Eigen::Vector3d p_model = ModelPlace(tile, column, row, HeightAt(tile, column, row));
      for (const ViewSight& sight : sights) {
        places[sight.view].push_back(
            {num_places,
             {.pixel = sight.sight.pixel, .level = LevelOf(sight, p_model) + kMoreLevels}});
      }
      ++num_places;
    }
  }
  for (std::size_t view = 0; view < places.size(); ++view) {
    if (places[view].empty()) continue;
    const ImagePyramid& image = cache_.Get(view);
    if (image.empty()) continue;
    for (const Place& place : places[view]) {
      samples.push_back(
          {place.index, view,
           ColourAt(image, place.tap.level, place.tap.pixel.x(), place.tap.pixel.y())});
    }
  }
}

void Orthophoto::Balance() {
  constexpr double kPlaces = 20'000;  // a gain is known to a thousandth by some hundred
  const double cells = static_cast<double>(grid_.width) * grid_.height;
  const int step = std::max(1, static_cast<int>(std::sqrt(cells / kPlaces)));
  std::vector<ColourSample> samples;
  std::size_t num_places = 0;
  ForEachTile([&](const cv::Rect& /*place*/, const std::optional<Tile>& tile) {
    if (tile) TakeSamples(*tile, step, samples, num_places);
  });
  std::ranges::stable_sort(samples, {}, &ColourSample::place);
  gains_ = BalanceViews(samples, views_.size());
}

cv::Mat Orthophoto::Draw(const Tile& tile) {
  const int width = tile.place.width, height = tile.place.height;
  // By rows, so that threads do not meet; then by views.
  std::vector<std::vector<std::pair<std::size_t, Tap>>> taps_of_rows(
      static_cast<std::size_t>(height));
  cv::parallel_for_({0, height}, [&](const cv::Range& rows) {
    std::vector<ViewSight> sights;
    for (int row = rows.start; row < rows.end; ++row) {
      for (int column = 0; column < width; ++column) {
        FindSights(tile, column, row, kMixedShare, sights);
        if (sights.empty()) continue;
        const Eigen::Vector3d p_model = ModelPlace(tile, column, row, HeightAt(tile, column, row));
        for (const ViewSight& sight : sights) {
          const float share = sight.sight.quality / sights[0].sight.quality;
          const float t = (share - kMixedShare) / (1 - kMixedShare);
          taps_of_rows[static_cast<std::size_t>(row)].push_back(
              {sight.view,
               {.cell = row * width + column,
                .pixel = sight.sight.pixel,
                .weight = t * t * (3 - 2 * t),
                .level = LevelOf(sight, p_model)}});
        }
      }
    }
  });
  std::vector<std::vector<Tap>> taps(views_.size());
  for (const auto& of_row : taps_of_rows) {
    for (const auto& [view, tap] : of_row) taps[view].push_back(tap);
  }
  cv::Mat sums(height, width, CV_32FC4, cv::Scalar::all(0));
  for (std::size_t view = 0; view < taps.size(); ++view) {
    if (taps[view].empty()) continue;
    const ImagePyramid& image = cache_.Get(view);
    if (image.empty()) continue;
    // A view has at most one tap in each cell.
    cv::parallel_for_({0, static_cast<int>(taps[view].size())}, [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) {
        const Tap& tap = taps[view][static_cast<std::size_t>(i)];
        const cv::Vec3f colour =
            ColourAt(image, tap.level, tap.pixel.x(), tap.pixel.y()).mul(gains_[view]);
        auto& sum = sums.at<cv::Vec4f>(tap.cell / width, tap.cell % width);
        for (int k = 0; k < 3; ++k) sum[k] += tap.weight * colour[2 - k];
        sum[3] += tap.weight;
      }
    });
  }
  cv::Mat cells(height, width, CV_8UC4, cv::Scalar::all(0));
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const auto& sum = sums.at<cv::Vec4f>(row, column);
      if (sum[3] <= 0) continue;
      auto& cell = cells.at<cv::Vec4b>(row, column);
      for (int k = 0; k < 3; ++k) cell[k] = cv::saturate_cast<std::uint8_t>(sum[k] / sum[3]);
      cell[3] = 255;
    }
  }
  return cells;
}

void Orthophoto::Render(const RasterSink& sink) {
  ForEachTile([&](const cv::Rect& place, const std::optional<Tile>& tile) {
    sink(place,
         tile ? Draw(*tile) : cv::Mat(place.height, place.width, CV_8UC4, cv::Scalar::all(0)));
  });
}

}  // namespace

OrthophotoReport MakeOrthophoto(const FinishedRun& run, const MapAxes& axes,
                                const HeightSource& heights, const RasterGrid& grid,
                                const RasterSink& sink) {
  FinishedRun used;
  OrthophotoReport report;
  for (const RunImage& image : run.images) {
    if (HasPixels(image)) {
      used.images.push_back(image);
    } else {
      report.missing_images.push_back(image.name);
    }
  }
  report.num_views = used.images.size();
  if (used.images.empty()) {
    throw Error(ErrorParts{.what = "the run has no images to make an orthophoto of",
                           .where = run.folder.string(),
                           .expected = "the images of its keyframes, in images/ or where they were",
                           .found = std::to_string(run.images.size()) + " named, none there",
                           .code = ErrorCode::kNotFound});
  }
  Orthophoto photo(used, axes, heights, grid);
  photo.Balance();
  photo.Render(sink);
  return report;
}

}  // namespace mono3d
