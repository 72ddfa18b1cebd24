// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/mesh_texturing.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/options.h"
#include "mono3d/image/undistorter.h"
#include "products/chart_atlas.h"
#include "products/mesh_picture.h"
#include "products/texture_painter.h"
#include "products/triangle_views.h"
#include "products/view_choice.h"
#include "products/view_shares.h"

namespace mono3d {
namespace {

void RequireMeshWithColours(const TriangleMesh& mesh) {
  const auto refuse = [](const std::string& expected, const std::string& found) {
    throw Error(ErrorParts{"no mesh to texture", "mesh", expected, found});
  };
  if (mesh.triangles.empty()) refuse("some triangles", "none");
  if (mesh.colours.size() != mesh.vertices.size() || mesh.normals.size() != mesh.vertices.size()) {
    refuse("a colour and a normal for each vertex", "fewer or more");
  }
  for (const auto& triangle : mesh.triangles) {
    if (std::ranges::max(triangle) >= mesh.vertices.size()) refuse("corners that are there", "not");
  }
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    if (!vertex.allFinite()) refuse("finite numbers", "a vertex that is not");
  }
}

// The views free of distortion; one image in memory at a time.
class UndistortedViews {
 public:
  explicit UndistortedViews(std::span<const TextureView> views) : views_(views) {
    for (const TextureView& view : views) {
      const Undistorter* undistorter = nullptr;
      for (const auto& [camera, known] : undistorters_) {
        if (camera == view.camera) undistorter = known.get();
      }
      if (undistorter == nullptr) {
        undistorters_.emplace_back(view.camera, std::make_unique<Undistorter>(view.camera));
        undistorter = undistorters_.back().second.get();
      }
      of_view_.push_back(undistorter);
      cameras_.push_back({undistorter->camera(), view.T_world_cam.Inverse()});
    }
  }

  std::span<const PinholeView> cameras() const { return cameras_; }

  // Empty, with a warning the first time, where the image cannot be read.
  cv::Mat Read(std::uint32_t view) {
    const CameraModel& camera = views_[view].camera;
    try {
      const cv::Mat image = views_[view].read();
      if (image.cols != camera.width || image.rows != camera.height || image.type() != CV_8UC3) {
        throw Error(ErrorParts{"an image has another size than its camera",
                               "view " + std::to_string(view),
                               std::to_string(camera.width) + "x" + std::to_string(camera.height),
                               std::to_string(image.cols) + "x" + std::to_string(image.rows)});
      }
      return of_view_[view]->Undistort(image);
    } catch (const Error& error) {
      Log(LogLevel::kWarning, std::string(error.what()) + "; the mesh is textured without it");
      return {};
    }
  }

 private:
  std::span<const TextureView> views_;
  std::vector<std::pair<CameraModel, std::unique_ptr<Undistorter>>> undistorters_;
  std::vector<const Undistorter*> of_view_;
  std::vector<PinholeView> cameras_;
};

// Mean of a few places in the triangle.
std::array<std::uint8_t, 3> MeanColour(const cv::Mat& image,
                                       const std::array<Eigen::Vector2f, 3>& corners) {
  const Eigen::Vector2f middle = (corners[0] + corners[1] + corners[2]) / 3;
  Eigen::Vector3f sum = ColourAt(image, middle);
  for (const Eigen::Vector2f& corner : corners) sum += ColourAt(image, (corner + middle) / 2);
  std::array<std::uint8_t, 3> mean{};
  for (int c = 0; c < 3; ++c) {
    mean.at(static_cast<std::size_t>(c)) = cv::saturate_cast<std::uint8_t>(sum[c] / 4);
  }
  return mean;
}

TriangleViews FindTriangleViews(const TriangleMesh& mesh, std::span<const TextureView> views,
                                UndistortedViews& undistorted, double surface_error_su) {
  TriangleViews found(mesh.triangles.size());
  std::size_t num_read = 0;
  for (std::uint32_t view = 0; view < views.size(); ++view) {
    const cv::Mat image = undistorted.Read(view);
    if (image.empty()) continue;
    ++num_read;
    const MeshPicture picture(mesh, undistorted.cameras()[view].camera, views[view].T_world_cam,
                              surface_error_su);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const std::optional<SeenTriangle> seen = picture.See(i);
      if (!seen) continue;
      const auto& [a, b, c] = mesh.triangles[i];
      found.Add(
          i, {.view = view,
              .area_px = seen->area_px,
              .colour = MeanColour(image, {picture.Pixel(a), picture.Pixel(b), picture.Pixel(c)}),
              .is_clear = seen->is_clear});
    }
  }
  if (num_read == 0) {
    throw Error(ErrorParts{.what = "no image to texture the mesh from",
                           .where = "images",
                           .expected = "the images of the run where they were",
                           .found = std::to_string(views.size()) + " that cannot be read",
                           .code = ErrorCode::kNotFound});
  }
  return found;
}

// One vertex for each chart that ends at it.
TexturedMesh MeshOfAtlas(const TriangleMesh& mesh, const ChartAtlas& atlas) {
  TexturedMesh textured;
  textured.triangles.resize(atlas.textures.size());
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> vertex_of;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    std::array<std::uint32_t, 3> triangle{};
    const cv::Size& size = atlas.textures[atlas.texture[i]];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t corner = mesh.triangles[i].at(k);
      const auto [place, is_new] = vertex_of.try_emplace(
          {atlas.chart[i], corner}, static_cast<std::uint32_t>(textured.vertices.size()));
      triangle.at(k) = place->second;
      if (!is_new) continue;
      textured.vertices.push_back(mesh.vertices[corner]);
      textured.normals.push_back(mesh.normals[corner]);
      const Eigen::Vector2f texel = atlas.texels[i].at(k).array() + .5F;
      textured.texture_coordinates.emplace_back(texel.x() / static_cast<float>(size.width),
                                                texel.y() / static_cast<float>(size.height));
    }
    textured.triangles[atlas.texture[i]].push_back(triangle);
  }
  return textured;
}

}  // namespace

void TexturingOptions::Validate() const {
  RequireOption(texture_side_px >= 64 && texture_side_px <= 32768, "texture_side_px", "64 to 32768",
                texture_side_px);
  RequireOption(max_textures >= 1, "max_textures", "1 or more", max_textures);
  RequireOption(num_blended >= 1, "num_blended", "1 or more", num_blended);
}

TexturingResult TextureMesh(const TriangleMesh& mesh, std::span<const TextureView> views,
                            double surface_error_su, const TexturingOptions& options) {
  options.Validate();
  RequireMeshWithColours(mesh);
  UndistortedViews undistorted(views);
  TriangleViews of_triangles = FindTriangleViews(mesh, views, undistorted, surface_error_su);
  const std::vector<Eigen::Vector3f> gains = EstimateGains(mesh, of_triangles, views.size());
  of_triangles.DropOutliers(gains);
  of_triangles.DropUnclear();
  const TriangleNeighbours neighbours = FindNeighbours(mesh);
  const std::vector<std::uint32_t> chosen = ChooseViews(of_triangles, neighbours);
  ViewShares shares = ShareViews(mesh, of_triangles, chosen, options.num_blended);
  LevelSeams(mesh, of_triangles, gains, shares);
  const ChartAtlas atlas = PackCharts(mesh, chosen, neighbours, undistorted.cameras(),
                                      options.texture_side_px, options.max_textures);

  TexturingResult result;
  result.mesh = MeshOfAtlas(mesh, atlas);
  result.num_charts = atlas.num_charts;
  result.texels_per_pixel = atlas.texels_per_pixel;
  result.num_unseen = static_cast<std::size_t>(std::ranges::count(chosen, kNoView));
  std::vector<bool> is_used(views.size(), false);
  for (const std::uint32_t view : chosen) {
    if (view != kNoView) is_used[view] = true;
  }
  result.num_views = static_cast<std::size_t>(std::ranges::count(is_used, true));
  const Paint paint{.mesh = mesh,
                    .views = of_triangles,
                    .chosen = chosen,
                    .shares = shares,
                    .atlas = atlas,
                    .cameras = undistorted.cameras(),
                    .gains = gains,
                    .read = [&](std::uint32_t view) { return undistorted.Read(view); }};
  for (std::uint32_t texture = 0; texture < atlas.textures.size(); ++texture) {
    result.mesh.textures.push_back(PaintTexture(paint, texture));
  }
  return result;
}

}  // namespace mono3d
