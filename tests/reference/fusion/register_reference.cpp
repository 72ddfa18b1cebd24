// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <utility>

#include "reference/fusion/fusion_reference.h"
#include "reference/fusion/view_reference.h"

namespace mono3d::reference {
namespace {

using Eigen::Vector3d;

constexpr double kHuber = 1.345;
// Central differences of residuals that are smooth over some pixels.
constexpr double kStep = 1e-6;

ViewParams ViewOf(const RegisterParams& params) {
  ViewParams view{};
  view.width_px = params.width_px;
  view.height_px = params.height_px;
  view.fx = params.fx;
  view.fy = params.fy;
  view.cx = params.cx;
  view.cy = params.cy;
  view.inverse_depth_sigma = params.inverse_depth_sigma;
  view.relative_sigma = params.relative_sigma;
  return view;
}

// A residual as a function of the unknowns, 0 at the present view.
using Residual = std::function<double(const Vector7d&)>;

double Add(const Residual& residual, RegistrationSystem& system) {
  const double r = residual(Vector7d::Zero());
  Vector7d derivative;
  for (int k = 0; k < 7; ++k) {
    const Vector7d step = kStep * Vector7d::Unit(k);
    derivative(k) = (residual(step) - residual(-step)) / (2 * kStep);
  }
  const double weight = std::min(1.0, kHuber / std::max(std::abs(r), 1e-12));
  system.information += weight * derivative * derivative.transpose();
  system.gradient += weight * r * derivative;
  return weight * r * r;
}

Vector3d Moved(const Vector3d& p_cam, const Vector7d& step) {
  return p_cam + step.head<3>().cross(p_cam) + step.segment<3>(3);
}

// The grey image between its pixels: the bilinear patch that contains `inside`, continued.
struct GreyPatch {
  double x, y, a, b, c, d, shrink;

  double At(const Eigen::Vector2d& pixel) const {
    const double s = (pixel.x() + 0.5) * shrink - 0.5 - x;
    const double t = (pixel.y() + 0.5) * shrink - 0.5 - y;
    return (1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * c + s * d);
  }
};

std::optional<GreyPatch> PatchAt(const RegisterParams& params, const std::vector<float>& grey,
                                 const Eigen::Vector2d& inside) {
  const int width = static_cast<int>(params.width_px >> params.grey_level);
  const int height = static_cast<int>(params.height_px >> params.grey_level);
  const double shrink = std::ldexp(1.0, -static_cast<int>(params.grey_level));
  const int x = static_cast<int>(std::floor((inside.x() + 0.5) * shrink - 0.5));
  const int y = static_cast<int>(std::floor((inside.y() + 0.5) * shrink - 0.5));
  if (x < 0 || y < 0 || x + 1 >= width || y + 1 >= height) return std::nullopt;
  const auto at = [&](int col, int row) {
    return static_cast<double>(grey[static_cast<std::size_t>(row * width + col)]);
  };
  return GreyPatch{static_cast<double>(x), static_cast<double>(y), at(x, y), at(x + 1, y),
                   at(x, y + 1),           at(x + 1, y + 1),       shrink};
}

double GreyOf(std::uint32_t rgb10) {
  const auto channel = [&](unsigned shift) {
    return static_cast<double>((rgb10 >> shift) & 0x3FFU);
  };
  return (0.299 * channel(0) + 0.587 * channel(10) + 0.114 * channel(20)) / 4;
}

struct GreySums {
  double image = 0, surfel = 0, image2 = 0, surfel2 = 0, product = 0, weight = 0;

  void Add(double of_image, double of_surfel, double by) {
    image += by * of_image, image2 += by * of_image * of_image;
    surfel += by * of_surfel, surfel2 += by * of_surfel * of_surfel;
    product += by * of_image * of_surfel;
    weight += by;
  }
};

bool IsClipped(double grey) { return grey > 254 || grey < 1; }

void AddGrey(const RegisterParams& params, const std::vector<float>& grey, const Vector3d& p_cam,
             std::uint32_t rgb10, RegistrationSystem& system, GreySums& sums) {
  const auto project = [&](const Vector3d& p) {
    return Eigen::Vector2d(params.fx * p.x() / p.z() + params.cx,
                           params.fy * p.y() / p.z() + params.cy);
  };
  const Eigen::Vector2d pixel = project(p_cam);
  const auto patch = PatchAt(params, grey, pixel);
  if (!patch) return;
  const double seen = patch->At(pixel);
  const double of_surfel = GreyOf(rgb10);
  if (IsClipped(seen) || IsClipped(of_surfel)) return;
  ++system.num_grey;
  if (params.grey_gain <= 0) return sums.Add(seen, of_surfel, 1);
  const Eigen::Vector2d gradient(
      (patch->At(pixel + Eigen::Vector2d(0.5, 0)) - patch->At(pixel - Eigen::Vector2d(0.5, 0))),
      (patch->At(pixel + Eigen::Vector2d(0, 0.5)) - patch->At(pixel - Eigen::Vector2d(0, 0.5))));
  const double sigma = std::hypot(params.grey_noise, params.grey_shift_px * gradient.norm());
  const double expected = params.grey_gain * of_surfel + params.grey_bias;
  system.grey_cost += Add(
      [&](const Vector7d& step) {
        return (patch->At(project(Moved(p_cam, step))) - expected) / sigma;
      },
      system);
  const double residual = std::abs(seen - expected) / sigma;
  sums.Add(seen, of_surfel, std::min(1.0, kHuber / std::max(residual, 1e-12)));
}

// The nearest surfel of each cell of some pixels.
class NearestSurfels {
 public:
  NearestSurfels(const RegisterParams& params, const AnchorTransforms& anchors,
                 const Surfels& surfels)
      : params_(params) {
    for (std::size_t i = 0; i < surfels.size(); ++i) {
      if (IsRemoved(surfels, i)) continue;
      const Vector3f p_cam =
          FromAnchorOf(anchors, surfels, i).Point(Head(surfels.position_radius[i]));
      const auto pixel = CellOf(ViewOf(params), p_cam, 1);
      if (!pixel) continue;
      float& nearest = depth_of_cell_.try_emplace(CellAt(*pixel), p_cam.z()).first->second;
      nearest = std::min(nearest, p_cam.z());
    }
  }

  // By their inverse depths, that of the surfel's plane over the cell included.
  bool Hide(const Vector3f& p_cam, const Vector3f& n, std::size_t pixel, float sigma) const {
    const float across =
        (std::abs(n.x()) / params_.fx + std::abs(n.y()) / params_.fy) / std::abs(Dot(n, p_cam));
    return 1 / depth_of_cell_.at(CellAt(pixel)) >
           1 / p_cam.z() + params_.association_sigmas * sigma + kCell_px * across;
  }

 private:
  static constexpr int kCell_px = 4;

  std::pair<int, int> CellAt(std::size_t pixel) const {
    const auto number = static_cast<int>(pixel), width = static_cast<int>(params_.width_px);
    return {number % width / kCell_px, number / width / kCell_px};
  }

  RegisterParams params_;
  std::map<std::pair<int, int>, float> depth_of_cell_;
};

}  // namespace

RegistrationSystem Register(const RegisterParams& params, const AnchorTransforms& anchors,
                            const PackedDepthMap& map, const Candidates& candidates,
                            const Surfels& surfels, const std::vector<float>& grey) {
  const ViewParams view = ViewOf(params);
  const NearestSurfels nearest(params, anchors, surfels);
  RegistrationSystem system;
  GreySums sums;
  for (std::size_t i = 0; i < surfels.size(); i += params.stride) {
    if (IsRemoved(surfels, i)) continue;
    const CameraFromAnchor to_camera = FromAnchorOf(anchors, surfels, i);
    const Vector3f p_cam = to_camera.Point(Head(surfels.position_radius[i]));
    const Vector3f n_surfel = to_camera.Direction(Head(surfels.normal_weight[i]));
    const auto pixel = CellOf(view, p_cam, 1);
    if (!pixel || Dot(n_surfel, p_cam) >= 0 || candidates[*pixel][3] <= 0) continue;
    const Vector3f n = Head(candidates[*pixel]);
    const Vector3f pixel_ray = Ray(view, static_cast<float>(*pixel % view.width_px),
                                   static_cast<float>(*pixel / view.width_px));
    const float depth = map.depth[*pixel];
    const Vector3f ray = p_cam / p_cam.z();
    const float expected = TangentPlaneInverseDepth(n, pixel_ray, 1 / depth, ray);
    const float sigma =
        JointSigma(view, 1 / depth, 1 / p_cam.z(), to_camera.Weight(surfels.normal_weight[i][3]));
    const float difference = 1 / p_cam.z() - expected;
    if (std::abs(difference) > params.association_sigmas * sigma) {
      if (params.leaves_out_hidden != 0 && difference < 0 &&
          nearest.Hide(p_cam, n_surfel, *pixel, sigma)) {
        continue;
      }
      ++(difference > 0 ? system.num_before : system.num_behind);
      continue;
    }
    if (Dot(n_surfel, n) < params.min_normal_cosine) continue;
    ++system.num_agree;
    const double along_normal = std::max(-n.dot(ray), 1e-3F) * p_cam.z() * p_cam.z() * sigma;
    const Vector3d p = p_cam.cast<double>();
    system.depth_cost += Add(
        [&](const Vector7d& step) {
          const Vector3d measured = depth * std::exp(step(6)) * pixel_ray.cast<double>();
          return n.cast<double>().dot(Moved(p, step) - measured) / along_normal;
        },
        system);
    AddGrey(params, grey, p, surfels.history[i][0], system, sums);
  }
  if (system.num_grey == 0) return system;
  const double count = sums.weight;
  system.image_grey_mean = sums.image / count;
  system.surfel_grey_mean = sums.surfel / count;
  system.image_grey_sigma = std::sqrt(sums.image2 / count - std::pow(system.image_grey_mean, 2));
  system.surfel_grey_sigma = std::sqrt(sums.surfel2 / count - std::pow(system.surfel_grey_mean, 2));
  system.grey_covariance = sums.product / count - system.image_grey_mean * system.surfel_grey_mean;
  return system;
}

}  // namespace mono3d::reference
