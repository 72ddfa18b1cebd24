// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/registration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <span>
#include <vector>

#include "fusion/grid.h"
#include "fusion/register.spirv.h"
#include "fusion/view.h"

namespace mono3d {
namespace {

// Neighbouring pixels match with overlapping census windows of 9x7: so many residuals hold one
// independent measurement.
constexpr double kPixelsPerMeasurement = 63;
// An evaluation looks at no more surfels than this on the finest level; four times fewer are
// enough on each coarser one.
constexpr std::uint32_t kMaxSamples = 262'144;
constexpr int kMaxIterationsPerLevel = 6;
// A step that moves the image by less ends a level, in pixels of that level.
constexpr double kSmallStep_px = 0.01;

// One depth map being registered.
struct Problem {
  const DepthMap& map;
  const SurfelMapOptions& options;
  RegisteredView predicted;
  double prior_factor;     // by which the prediction is less sure than the options say
  double median_depth_su;  // as the map has it
  double focal_px;
};

// Motion of the image, in pixels, of a motion of the camera.
double ImageMotion(const Problem& problem, const Vector7d& step) {
  return problem.focal_px *
         std::hypot(step.head<3>().norm(), step.segment<3>(3).norm() / problem.median_depth_su);
}

// From the prediction to `view`, as the unknowns of one step.
Vector7d Deviation(const Problem& problem, const RegisteredView& view) {
  const Pose moved = view.T_world_cam.Inverse() * problem.predicted.T_world_cam;
  Vector7d deviation;
  deviation << RotationLog(moved.rotation()), moved.translation(),
      std::log(view.depth_scale / problem.predicted.depth_scale);
  return deviation;
}

Vector7d PriorInformation(const Problem& problem) {
  const RegistrationOptions& options = problem.options.registration;
  const double rotation = options.prior_px / problem.focal_px;
  const double translation_su = rotation * problem.median_depth_su;
  Vector7d sigma;
  sigma << Eigen::Vector3d::Constant(rotation), Eigen::Vector3d::Constant(translation_su),
      options.prior_scale;
  return (problem.prior_factor * sigma).cwiseAbs2().cwiseInverse();
}

void Move(RegisteredView& view, const Vector7d& step) {
  const Pose moved(RotationExp(step.head<3>()), step.segment<3>(3));
  view.T_world_cam = (moved * view.T_world_cam.Inverse()).Inverse();
  view.depth_scale *= std::exp(step(6));
}

RegisterParams MakeParams(const Problem& problem, const RegisteredView& view,
                          std::uint32_t num_surfels, int level) {
  DepthMap at_view;  // its images play no part
  at_view.camera = problem.map.camera;
  at_view.T_world_cam = view.T_world_cam;
  at_view.depth_sigma_per_square_depth =
      problem.map.depth_sigma_per_square_depth / view.depth_scale;
  const ViewParams same = MakeViewParams(at_view, problem.options, num_surfels, 0);
  RegisterParams params{};
  params.width_px = same.width_px;
  params.height_px = same.height_px;
  params.fx = same.fx;
  params.fy = same.fy;
  params.cx = same.cx;
  params.cy = same.cy;
  std::copy(std::begin(same.cam_from_world), std::end(same.cam_from_world), params.cam_from_world);
  params.inverse_depth_sigma = same.inverse_depth_sigma;
  params.relative_sigma = same.relative_sigma;
  params.association_sigmas = std::ldexp(same.association_sigmas, level);
  params.min_normal_cosine = same.min_normal_cosine;
  params.num_surfels = num_surfels;
  const std::uint32_t max_samples = kMaxSamples >> static_cast<unsigned>(2 * level);
  params.stride = std::max((num_surfels + max_samples - 1) / max_samples, 1U);
  params.depth_scale = static_cast<float>(view.depth_scale);
  params.grey_level = static_cast<std::uint32_t>(level);
  params.grey_noise = static_cast<float>(problem.options.registration.grey_noise);
  params.grey_shift_px = static_cast<float>(problem.options.registration.grey_shift_px);
  return params;
}

// Exposure drifts from map to map: mean and contrast of what both see are made equal.
void SetExposure(RegisterParams& params, const RegistrationSystem& system) {
  params.grey_gain = 0;
  if (static_cast<double>(system.num_grey) < kPixelsPerMeasurement ||
      system.surfel_grey_sigma < params.grey_noise || system.image_grey_sigma < params.grey_noise) {
    return;
  }
  params.grey_gain = static_cast<float>(system.image_grey_sigma / system.surfel_grey_sigma);
  params.grey_bias =
      static_cast<float>(system.image_grey_mean - params.grey_gain * system.surfel_grey_mean);
}

// The step of Gauss and Newton, with the prior.
Vector7d Solve(const Problem& problem, const RegistrationSystem& system, const RegisteredView& view,
               std::uint32_t stride) {
  // Sampled residuals stand for `stride` each, and hold as much as independent ones among them.
  const double independent = std::min(1.0, stride / kPixelsPerMeasurement);
  const Vector7d prior = PriorInformation(problem);
  Matrix7d information = independent * system.information;
  information.diagonal() += prior;
  Vector7d gradient = independent * system.gradient;
  gradient += prior.cwiseProduct(Deviation(problem, view));
  if (!problem.options.registration.with_scale) {
    information.row(6).setZero();
    information.col(6).setZero();
    information(6, 6) = 1;
    gradient(6) = 0;
  }
  // Rotations, lengths and logarithms have units of their own: solved on a unit diagonal.
  const Vector7d unit = information.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix7d scaled = unit.asDiagonal() * information * unit.asDiagonal();
  return -unit.cwiseProduct(scaled.ldlt().solve(unit.cwiseProduct(gradient)));
}

double MedianDepth(const DepthMap& map) {
  constexpr int kStep = 7;  // every 49th pixel: thousands of any usable map
  std::vector<float> depths;
  for (int y = 0; y < map.depth.rows; y += kStep) {
    for (int x = 0; x < map.depth.cols; x += kStep) {
      const float z = map.depth.at<float>(y, x);
      if (z > 0 && std::isfinite(z)) depths.push_back(z);
    }
  }
  if (depths.empty()) return 0;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

RegistrationEvidence EvidenceOf(const Problem& problem, const RegistrationSystem& system,
                                std::uint32_t stride, const RegisteredView& view) {
  RegistrationEvidence evidence;
  const auto agree = static_cast<double>(system.num_agree);
  const auto in_view =
      static_cast<double>(system.num_agree + system.num_before + system.num_behind);
  const auto num_pixels = static_cast<double>(CountEstimates(problem.map));
  evidence.overlap = num_pixels > 0 ? std::min(1.0, in_view * stride / num_pixels) : 0;
  evidence.agreement = in_view > 0 ? agree / in_view : 0;
  evidence.contradiction = in_view > 0 ? static_cast<double>(system.num_before) / in_view : 0;
  if (system.num_agree > 0) evidence.depth_residual = std::sqrt(system.depth_cost / agree);
  if (system.num_grey > 0) {
    evidence.grey_residual = std::sqrt(system.grey_cost / static_cast<double>(system.num_grey));
  }
  const Vector7d deviation = Deviation(problem, view);
  evidence.deviation_px = ImageMotion(problem, deviation);
  evidence.scale_deviation = deviation(6);
  return evidence;
}

std::string Found(const char* what, double found, const char* expected, double limit) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%s %.3g, %s %.3g expected", what, found, expected,
                limit);
  return text.data();
}

// Whether the registration may be used: if not, why. With hardly any of the model in view there is
// nothing to say: the prediction stands.
void Judge(Registration& registration, const RegisteredView& predicted,
           const RegistrationGateOptions& gate) {
  RegistrationEvidence& evidence = registration.evidence;
  if (evidence.overlap < gate.min_overlap) {
    registration.view = predicted;
    return;
  }
  evidence.registered = true;
  std::string& why = registration.rejection;
  if (evidence.agreement < gate.min_agreement) {
    why = Found("agreement with the model", evidence.agreement, "at least", gate.min_agreement);
  } else if (evidence.contradiction > gate.max_contradiction) {
    why = Found("share of the model seen through", evidence.contradiction, "at most",
                gate.max_contradiction);
  } else if (evidence.depth_residual > gate.max_residual) {
    why = Found("distance from the model in sigmas", evidence.depth_residual, "at most",
                gate.max_residual);
  } else if (evidence.deviation_px > gate.max_deviation_px) {
    why = Found("pixels from the tracker's pose", evidence.deviation_px, "at most",
                gate.max_deviation_px);
  } else if (std::abs(evidence.scale_deviation) > gate.max_scale_deviation) {
    why = Found("deviation from the tracker's scale", evidence.scale_deviation, "at most",
                gate.max_scale_deviation);
  }
  if (!why.empty()) why = "not registered with the model: " + why;
}

}  // namespace

std::string Describe(const RegistrationEvidence& evidence) {
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "overlap %.2f, agreement %.3f, contradiction %.3f, depth %.2f and grey %.2f sigmas "
                "from the model, "
                "%.3f px and %.3f %% of scale from the tracker, %d iterations",
                evidence.overlap, evidence.agreement, evidence.contradiction,
                evidence.depth_residual, evidence.grey_residual, evidence.deviation_px,
                100 * evidence.scale_deviation, evidence.num_iterations);
  return text.data();
}

Registrar::Registrar(const std::shared_ptr<Device>& device)
    : device_(device), register_(device, {"fusion/register", fusion_register_spirv}) {}

void Registrar::UploadGrey(const DepthMap& map) {
  cv::Mat grey;
  if (map.bgr.empty()) {
    grey = cv::Mat(map.camera.height, map.camera.width, CV_8UC1, cv::Scalar(0));
  } else {
    cv::cvtColor(map.bgr, grey, cv::COLOR_BGR2GRAY);
  }
  cv::Mat level;
  grey.convertTo(level, CV_32F);
  for (Buffer& buffer : grey_) {
    const std::size_t bytes = std::max<std::size_t>(level.total() * sizeof(float), 4);
    if (buffer.size_bytes() != bytes) buffer = Buffer(device_, bytes, "fusion/grey");
    if (level.empty()) continue;
    buffer.Upload(std::span<const float>(level.ptr<float>(), level.total()));
    // Means of 2x2 pixels: the centre of pixel u of the half is that of 2u + 0.5.
    const cv::Size half(level.cols / 2, level.rows / 2);
    cv::Mat next;
    if (!half.empty()) {
      const cv::Rect whole_pairs(0, 0, 2 * half.width, 2 * half.height);
      cv::resize(level(whole_pairs), next, half, 0, 0, cv::INTER_AREA);
    }
    level = next;
  }
}

RegistrationSystem Registrar::Evaluate(Recorder& recorder, const RegisterParams& params,
                                       const DepthMapBuffers& buffers, const SurfelStorage& surfels,
                                       StageTimes* times) {
  const std::uint32_t num_samples = DivideRoundingUp(params.num_surfels, params.stride);
  const std::uint32_t num_rows = DivideRoundingUp(num_samples, kSurfelsPerRegistrationRow);
  const std::size_t num_floats = std::size_t{num_rows} * kFloatsPerRegistrationRow;
  if (num_rows == 0) return {};
  if (rows_.size_bytes() < num_floats * sizeof(float)) {
    rows_ = Buffer(device_, num_floats * sizeof(float), "fusion/registration_rows");
  }
  recorder.Dispatch(register_,
                    {surfels.position_radius(), surfels.normal_weight(), surfels.history(),
                     buffers.depth, buffers.candidate, grey_.at(params.grey_level), rows_},
                    params, GridFor(register_, num_rows));
  recorder.Submit(times);
  downloaded_.resize(num_floats);
  rows_.Download(std::span<float>(downloaded_));
  return SumRegistrationRows(downloaded_);
}

Registration Registrar::Register(Recorder& recorder, const DepthMap& map,
                                 const DepthMapBuffers& buffers, const SurfelStorage& surfels,
                                 const Prediction& prediction, const SurfelMapOptions& options,
                                 StageTimes* times) {
  const RegisteredView& predicted = prediction.view;
  // As a random walk: with the square root of the steps.
  const double prior_factor = std::sqrt(1.0 + prediction.num_missed);
  const Problem problem{map,          options,          predicted,
                        prior_factor, MedianDepth(map), std::min(map.camera.fx, map.camera.fy)};
  Registration registration{predicted, {}, {}};
  RegisteredView& view = registration.view;
  UploadGrey(map);
  RegistrationSystem system;
  RegisterParams params{};
  int num_iterations = 0;
  for (int level = kNumLevels - 1; level >= 0; --level) {
    for (int iteration = 0; iteration < kMaxIterationsPerLevel; ++iteration) {
      params = MakeParams(problem, view, surfels.size(), level);
      if (options.registration.with_grey && !map.bgr.empty()) SetExposure(params, system);
      system = Evaluate(recorder, params, buffers, surfels, times);
      ++num_iterations;
      const Vector7d step = Solve(problem, system, view, params.stride);
      Move(view, step);
      if (std::ldexp(ImageMotion(problem, step), -level) < kSmallStep_px) break;
    }
  }
  registration.evidence = EvidenceOf(problem, system, params.stride, view);
  registration.evidence.num_iterations = num_iterations;
  Judge(registration, predicted, options.gate);
  return registration;
}

}  // namespace mono3d
