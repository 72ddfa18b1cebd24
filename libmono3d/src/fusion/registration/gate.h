// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <string>

#include "fusion/registration/problem.h"

namespace mono3d {

// What is done with surfels behind the surface that a depth map shows.
enum class SurfelsBehind {
  kCount,       // they disagree: the depth map may be too near
  kAreLeftOut,  // the depth map hides them
};

// What `system`, evaluated at `S_world_kf` over every `stride`-th surfel, says of the registration.
RegistrationEvidence EvidenceOf(const RegistrationProblem& problem,
                                const RegistrationSystem& system, std::uint32_t stride,
                                const Similarity& S_world_kf,
                                SurfelsBehind behind = SurfelsBehind::kCount);

// Why a depth map with this evidence must not be fused; empty: it may.
std::string RejectionReason(const RegistrationEvidence& evidence,
                            const RegistrationGateOptions& gate);

// One line for people.
std::string Describe(const RegistrationEvidence& evidence);

}  // namespace mono3d
