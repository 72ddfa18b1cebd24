// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/texture_painter.h"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "products/mesh_picture.h"
#include "products/triangle_raster.h"

namespace mono3d {
namespace {

// What the chosen view counts at least: where shares are cut off it may have none.
constexpr float kLeastShare = 1e-3F;

struct TriangleOfView {
  std::uint32_t view = 0;
  std::uint32_t triangle = 0;
};

// The triangles of a texture once for each view that has a share in them, by view.
std::vector<TriangleOfView> TrianglesByView(const Paint& paint, std::uint32_t texture) {
  std::vector<TriangleOfView> all;
  for (std::uint32_t i = 0; i < paint.mesh.triangles.size(); ++i) {
    if (paint.atlas.texture[i] != texture || paint.chosen[i] == kNoView) continue;
    for (const TriangleView& view : paint.views.Of(i)) {
      bool has_share = view.view == paint.chosen[i];
      for (const std::uint32_t corner : paint.mesh.triangles[i]) {
        has_share = has_share || std::ranges::find(paint.shares[corner], view.view,
                                                   &ViewShare::view) != paint.shares[corner].end();
      }
      if (has_share) all.push_back({view.view, i});
    }
  }
  std::ranges::sort(all, [](const TriangleOfView& a, const TriangleOfView& b) {
    return std::pair(a.view, a.triangle) < std::pair(b.view, b.triangle);
  });
  return all;
}

class TexturePainter {
 public:
  TexturePainter(const Paint& paint, std::uint32_t texture)
      : paint_(paint), sums_(cv::Mat::zeros(paint.atlas.textures[texture], CV_32FC4)) {}

  void Add(const TriangleOfView& part, const cv::Mat& image) {
    const auto& corners = paint_.mesh.triangles[part.triangle];
    Eigen::Vector3f shares = Eigen::Vector3f::Zero();
    Eigen::Matrix3f adjustments = Eigen::Matrix3f::Zero();  // columns: corners
    Eigen::Matrix3f points;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t corner = corners.at(static_cast<std::size_t>(k));
      points.col(k) = paint_.mesh.vertices[corner];
      const auto& of = paint_.shares[corner];
      const auto found = std::ranges::find(of, part.view, &ViewShare::view);
      if (found == of.end()) continue;
      shares[k] = found->share;
      adjustments.col(k) = found->adjustment;
    }
    if (part.view == paint_.chosen[part.triangle]) shares = shares.cwiseMax(kLeastShare);
    const PinholeView& camera = paint_.cameras[part.view];
    const Eigen::Vector3f& gain = paint_.gains[part.view];
    RasteriseTriangle(paint_.atlas.texels[part.triangle], sums_.size(),
                      [&](int x, int y, const Eigen::Vector3f& at) {
                        const float share = shares.dot(at);
                        if (!(share > 0)) return;
                        const Eigen::Vector3f colour =
                            gain.cwiseProduct(ColourAt(image, camera.Pixel(points * at))) +
                            adjustments * at;
                        AddTexel(x, y, colour, share);
                      });
  }

  // Colours of the mesh, for a triangle that no view shows.
  void AddUnseen(std::uint32_t triangle) {
    Eigen::Matrix3f colours;
    for (int k = 0; k < 3; ++k) {
      const auto& [red, green, blue] =
          paint_.mesh.colours[paint_.mesh.triangles[triangle].at(static_cast<std::size_t>(k))];
      colours.col(k) = Eigen::Vector3f(blue, green, red);
    }
    RasteriseTriangle(
        paint_.atlas.texels[triangle], sums_.size(),
        [&](int x, int y, const Eigen::Vector3f& at) { AddTexel(x, y, colours * at, 1); });
  }

  cv::Mat Finish() {
    cv::Mat texture(sums_.size(), CV_8UC3, cv::Scalar::all(0));
    cv::Mat is_painted = cv::Mat::zeros(sums_.size(), CV_8UC1);
    cv::Vec3d mean(0, 0, 0);
    double count = 0;
    for (int y = 0; y < sums_.rows; ++y) {
      for (int x = 0; x < sums_.cols; ++x) {
        const cv::Vec4f& sum = sums_.at<cv::Vec4f>(y, x);
        if (sum[3] <= 0) continue;
        const cv::Vec3f colour(sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]);
        auto& texel = texture.at<cv::Vec3b>(y, x);
        for (int c = 0; c < 3; ++c) texel[c] = cv::saturate_cast<uchar>(colour[c]);
        is_painted.at<uchar>(y, x) = 255;
        mean += colour;
        ++count;
      }
    }
    for (int ring = 0; ring < kGutter_px; ++ring) RepeatBorders(texture, is_painted);
    if (count > 0) mean /= count;
    // What belongs to no chart: of small coarse levels of the texture it shows a little.
    texture.setTo(cv::Scalar(mean[0], mean[1], mean[2]), is_painted == 0);
    return texture;
  }

 private:
  void AddTexel(int x, int y, const Eigen::Vector3f& colour, float share) {
    cv::Vec4f& sum = sums_.at<cv::Vec4f>(y, x);
    for (int c = 0; c < 3; ++c) sum[c] += share * colour[c];
    sum[3] += share;
  }

  // Empty texels beside painted ones take their mean.
  static void RepeatBorders(cv::Mat& texture, cv::Mat& is_painted) {
    const cv::Mat was_painted = is_painted.clone();
    for (int y = 0; y < texture.rows; ++y) {
      for (int x = 0; x < texture.cols; ++x) {
        if (was_painted.at<uchar>(y, x) != 0) continue;
        cv::Vec3i sum(0, 0, 0);
        int count = 0;
        for (int row = std::max(y - 1, 0); row <= std::min(y + 1, texture.rows - 1); ++row) {
          for (int column = std::max(x - 1, 0); column <= std::min(x + 1, texture.cols - 1);
               ++column) {
            if (was_painted.at<uchar>(row, column) == 0) continue;
            sum += cv::Vec3i(texture.at<cv::Vec3b>(row, column));
            ++count;
          }
        }
        if (count == 0) continue;
        for (int c = 0; c < 3; ++c) {
          texture.at<cv::Vec3b>(y, x)[c] = static_cast<uchar>((sum[c] + count / 2) / count);
        }
        is_painted.at<uchar>(y, x) = 255;
      }
    }
  }

  const Paint& paint_;
  cv::Mat sums_;  // blue, green, red times shares, and the shares
};

}  // namespace

cv::Mat PaintTexture(const Paint& paint, std::uint32_t texture) {
  TexturePainter painter(paint, texture);
  const std::vector<TriangleOfView> parts = TrianglesByView(paint, texture);
  cv::Mat image;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i == 0 || parts[i].view != parts[i - 1].view) image = paint.read(parts[i].view);
    if (!image.empty()) painter.Add(parts[i], image);
  }
  for (std::uint32_t i = 0; i < paint.mesh.triangles.size(); ++i) {
    if (paint.atlas.texture[i] == texture && paint.chosen[i] == kNoView) painter.AddUnseen(i);
  }
  return painter.Finish();
}

}  // namespace mono3d
