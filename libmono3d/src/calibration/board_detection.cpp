// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/board_detection.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numbers>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {
namespace calibration {
namespace {

// Larger images are searched at this size and the corners measured in the whole image: the time of
// the search grows with the pixels, above all where there is no board.
constexpr int kMaxSearchSide_px = 960;

struct NamedDictionary {
  const char* name;
  cv::aruco::PREDEFINED_DICTIONARY_NAME dictionary;
};
constexpr std::array kDictionaries = {
    NamedDictionary{"DICT_4X4_50", cv::aruco::DICT_4X4_50},
    NamedDictionary{"DICT_4X4_100", cv::aruco::DICT_4X4_100},
    NamedDictionary{"DICT_4X4_250", cv::aruco::DICT_4X4_250},
    NamedDictionary{"DICT_4X4_1000", cv::aruco::DICT_4X4_1000},
    NamedDictionary{"DICT_5X5_50", cv::aruco::DICT_5X5_50},
    NamedDictionary{"DICT_5X5_100", cv::aruco::DICT_5X5_100},
    NamedDictionary{"DICT_5X5_250", cv::aruco::DICT_5X5_250},
    NamedDictionary{"DICT_5X5_1000", cv::aruco::DICT_5X5_1000},
    NamedDictionary{"DICT_6X6_50", cv::aruco::DICT_6X6_50},
    NamedDictionary{"DICT_6X6_100", cv::aruco::DICT_6X6_100},
    NamedDictionary{"DICT_6X6_250", cv::aruco::DICT_6X6_250},
    NamedDictionary{"DICT_6X6_1000", cv::aruco::DICT_6X6_1000},
    NamedDictionary{"DICT_7X7_50", cv::aruco::DICT_7X7_50},
    NamedDictionary{"DICT_7X7_100", cv::aruco::DICT_7X7_100},
    NamedDictionary{"DICT_7X7_250", cv::aruco::DICT_7X7_250},
    NamedDictionary{"DICT_7X7_1000", cv::aruco::DICT_7X7_1000},
    NamedDictionary{"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
    NamedDictionary{"DICT_APRILTAG_16h5", cv::aruco::DICT_APRILTAG_16h5},
    NamedDictionary{"DICT_APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9},
    NamedDictionary{"DICT_APRILTAG_36h10", cv::aruco::DICT_APRILTAG_36h10},
    NamedDictionary{"DICT_APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11},
};

const NamedDictionary* FindDictionary(const std::string& name) {
  const auto* found = std::find_if(kDictionaries.begin(), kDictionaries.end(),
                                   [&](const NamedDictionary& d) { return name == d.name; });
  return found == kDictionaries.end() ? nullptr : found;
}

// Places the corners to a few hundredths of a pixel. Those of the detectors are not: SB is wrong by
// a quarter of a pixel in steep views, ChArUco of OpenCV 4.6 by half a pixel in x and y everywhere.
// `reach`: how far around a corner there is nothing but it, in squares.
void RefineCorners(const cv::Mat& grey, double reach, BoardView& view) {
  const std::vector<cv::Point2f> rough = view.pixels;
  for (std::size_t i = 0; i < rough.size(); ++i) {
    double square_px = std::max(grey.cols, grey.rows);  // the shortest side at this corner
    for (std::size_t k = 0; k < rough.size(); ++k) {
      if (k == i || cv::norm(view.corners[i] - view.corners[k]) > 1.01) continue;
      square_px = std::min(square_px, cv::norm(rough[i] - rough[k]));
    }
    const int radius = std::clamp(static_cast<int>(reach * square_px), 2, 15);
    std::vector<cv::Point2f> corner = {rough[i]};
    cv::cornerSubPix(grey, corner, {radius, radius}, {-1, -1},
                     {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.001});
    view.pixels[i] = corner[0];
  }
}

class ChessboardDetector : public BoardDetector {
 public:
  explicit ChessboardDetector(cv::Size size) : size_(size) {
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        corners_.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.F);
      }
    }
  }

  std::optional<BoardView> Find(const cv::Mat& grey) const override {
    const double scale =
        std::max(1., static_cast<double>(std::max(grey.cols, grey.rows)) / kMaxSearchSide_px);
    cv::Mat searched = grey;
    if (scale > 1) cv::resize(grey, searched, {}, 1 / scale, 1 / scale, cv::INTER_AREA);
    BoardView view{corners_, {}};
    if (!FindGrid(searched, view.pixels)) return std::nullopt;
    for (cv::Point2f& pixel : view.pixels) {
      pixel =
          static_cast<float>(scale) * (pixel + cv::Point2f(0.5F, 0.5F)) - cv::Point2f(0.5F, 0.5F);
    }
    constexpr double kReach = 0.4;  // half of a square, and some room for a tilt
    RefineCorners(grey, kReach, view);
    return view;
  }

 private:
  bool FindGrid(const cv::Mat& grey, std::vector<cv::Point2f>& pixels) const {
    if (cv::findChessboardCornersSB(grey, size_, pixels, cv::CALIB_CB_NORMALIZE_IMAGE)) return true;
    // The older detector finds some that the newer one does not, as with a narrow white border.
    return cv::findChessboardCorners(
        grey, size_, pixels,
        cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK);
  }

  cv::Size size_;
  std::vector<cv::Point3f> corners_;
};

class CharucoDetector : public BoardDetector {
 public:
  explicit CharucoDetector(const CalibrationBoard& board)
      : dictionary_(
            cv::aruco::getPredefinedDictionary(FindDictionary(board.dictionary)->dictionary)),
        board_(cv::aruco::CharucoBoard::create(
            board.columns, board.rows, 1.F, static_cast<float>(board.marker_share), dictionary_)),
        reach_((1 - board.marker_share) / (2 * std::numbers::sqrt2)) {}

  std::optional<BoardView> Find(const cv::Mat& grey) const override {
    std::vector<std::vector<cv::Point2f>> markers;
    std::vector<int> marker_ids;
    cv::aruco::detectMarkers(grey, dictionary_, markers, marker_ids);
    if (marker_ids.empty()) return std::nullopt;
    BoardView view;
    std::vector<int> ids;
    cv::aruco::interpolateCornersCharuco(markers, marker_ids, grey, board_, view.pixels, ids);
    for (const int id : ids) {
      view.corners.push_back(board_->chessboardCorners[static_cast<std::size_t>(id)]);
    }
    if (!SpansAPlane(view.corners)) return std::nullopt;
    RefineCorners(grey, reach_, view);
    return view;
  }

 private:
  // A homography needs four corners, no three in line; more average the noise.
  static bool SpansAPlane(const std::vector<cv::Point3f>& corners) {
    constexpr std::size_t kMinCorners = 8;
    constexpr float kMinSpan = 1.5F;  // squares
    if (corners.size() < kMinCorners) return false;
    const auto span = [&](auto coordinate) {
      const auto [low, high] = std::minmax_element(
          corners.begin(), corners.end(),
          [&](const auto& a, const auto& b) { return coordinate(a) < coordinate(b); });
      return coordinate(*high) - coordinate(*low);
    };
    return span([](const cv::Point3f& p) { return p.x; }) > kMinSpan &&
           span([](const cv::Point3f& p) { return p.y; }) > kMinSpan;
  }

  cv::Ptr<cv::aruco::Dictionary> dictionary_;
  cv::Ptr<cv::aruco::CharucoBoard> board_;
  // The largest window around a corner, turned in any way, that holds no marker: in squares.
  double reach_;
};

}  // namespace

std::unique_ptr<BoardDetector> CreateBoardDetector(const CalibrationBoard& board) {
  board.Validate();
  if (board.kind == BoardKind::kCharuco) return std::make_unique<CharucoDetector>(board);
  return std::make_unique<ChessboardDetector>(cv::Size(board.columns, board.rows));
}

}  // namespace calibration

void CalibrationBoard::Validate() const {
  // What the detectors find.
  constexpr int kMinCorners = 3;
  constexpr int kMaxCorners = 50;
  const bool is_charuco = kind == BoardKind::kCharuco;
  for (const int side : {columns, rows}) {
    const int corners = is_charuco ? side - 1 : side;
    if (corners >= kMinCorners && corners <= kMaxCorners) continue;
    throw UsageError(ErrorParts{.what = "bad calibration board",
                                .where = {},
                                .expected = "3 to 50 inner corners along each side",
                                .found = std::to_string(corners)});
  }
  if (!is_charuco) return;
  if (!(marker_share > 0 && marker_share < 1)) {
    throw UsageError("the markers of a ChArUco board must be smaller than its squares");
  }
  const calibration::NamedDictionary* named = calibration::FindDictionary(dictionary);
  if (named == nullptr) {
    throw UsageError(ErrorParts{.what = "unknown dictionary of markers",
                                .where = {},
                                .expected = "DICT_5X5_100, DICT_4X4_50 or another of OpenCV",
                                .found = dictionary});
  }
  const int num_markers = columns * rows / 2;
  const int num_known = cv::aruco::getPredefinedDictionary(named->dictionary)->bytesList.rows;
  if (num_markers > num_known) {
    throw UsageError(ErrorParts{.what = "the dictionary has too few markers for the board",
                                .where = dictionary,
                                .expected = std::to_string(num_markers),
                                .found = std::to_string(num_known)});
  }
}

}  // namespace mono3d
