// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/registration/gate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace mono3d {
namespace {

std::string Found(const char* what, double found, const char* expected, double limit) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%s %.3g, %s %.3g expected", what, found, expected,
                limit);
  return text.data();
}

}  // namespace

RegistrationEvidence EvidenceOf(const RegistrationProblem& problem,
                                const RegistrationSystem& system, std::uint32_t stride,
                                const Similarity& S_world_kf, SurfelsBehind behind) {
  RegistrationEvidence evidence;
  const auto agree = static_cast<double>(system.num_agree);
  const auto num_behind = behind == SurfelsBehind::kCount ? system.num_behind : 0;
  const auto in_view = static_cast<double>(system.num_agree + system.num_before + num_behind);
  const auto num_pixels = static_cast<double>(CountEstimates(problem.map));
  evidence.overlap = num_pixels > 0 ? std::min(1.0, in_view * stride / num_pixels) : 0;
  evidence.agreement = in_view > 0 ? agree / in_view : 0;
  evidence.contradiction = in_view > 0 ? static_cast<double>(system.num_before) / in_view : 0;
  if (system.num_agree > 0) evidence.depth_residual = std::sqrt(system.depth_cost / agree);
  if (system.num_grey > 0) {
    evidence.grey_residual = std::sqrt(system.grey_cost / static_cast<double>(system.num_grey));
  }
  const double contrast = system.image_grey_sigma * system.surfel_grey_sigma;
  if (contrast > 0) evidence.grey_correlation = system.grey_covariance / contrast;
  const Vector7d deviation = Deviation(problem, S_world_kf);
  evidence.deviation_px = ImageMotion(problem, deviation);
  evidence.scale_deviation = deviation(6);
  evidence.uncertainty_px = Uncertainty_px(problem, system, stride);
  return evidence;
}

std::string RejectionReason(const RegistrationEvidence& evidence,
                            const RegistrationGateOptions& gate) {
  struct Limit {
    const char* what;
    double found;
    bool is_lowest;
    double limit;
  };
  const std::array<Limit, 6> limits = {
      {{"agreement with the model", evidence.agreement, true, gate.min_agreement},
       {"share of the model seen through", evidence.contradiction, false, gate.max_contradiction},
       {"distance from the model in sigmas", evidence.depth_residual, false, gate.max_residual},
       {"grey value from the model in sigmas", evidence.grey_residual, false,
        gate.max_grey_residual},
       {"pixels from the tracker's pose", evidence.deviation_px, false, gate.max_deviation_px},
       {"deviation from the tracker's scale", std::abs(evidence.scale_deviation), false,
        gate.max_scale_deviation}}};
  for (const Limit& limit : limits) {
    const bool holds = limit.is_lowest ? limit.found >= limit.limit : limit.found <= limit.limit;
    if (holds) continue;
    return "not registered with the model: " +
           Found(limit.what, limit.found, limit.is_lowest ? "at least" : "at most", limit.limit);
  }
  return {};
}

std::string Describe(const RegistrationEvidence& evidence) {
  std::array<char, 320> text{};
  std::snprintf(text.data(), text.size(),
                "overlap %.2f, noise %.1f, agreement %.3f, contradiction %.3f, depth %.2f and grey "
                "%.2f sigmas "
                "from the model, correlation %.3f, "
                "%s, misfit of the tracker %.2f sigmas, %.3f px and %.3f %% of scale from it, "
                "known to %.2f px, "
                "%d evaluations",
                evidence.overlap, evidence.noise, evidence.agreement, evidence.contradiction,
                evidence.depth_residual, evidence.grey_residual, evidence.grey_correlation,
                evidence.moved ? "moved" : "not moved", evidence.tracker_misfit,
                evidence.deviation_px, 100 * evidence.scale_deviation, evidence.uncertainty_px,
                evidence.num_iterations);
  return text.data();
}

}  // namespace mono3d
