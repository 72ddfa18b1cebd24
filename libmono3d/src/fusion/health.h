// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <deque>

#include "mono3d/fusion/model_health.h"
#include "mono3d/fusion/registration.h"

namespace mono3d {

// Looks back upon the latest registrations.
class HealthMonitor {
 public:
  explicit HealthMonitor(const HealthOptions& options) : options_(options) {}

  // A depth map was registered with the model, and accepted or not.
  void Add(const RegistrationEvidence& evidence, bool is_accepted);
  // A depth map that had been refused was accepted after all.
  void AcceptLate();
  // The model was repaired: what was before says nothing of it.
  void Forget() { records_.clear(); }

  ModelHealth Assess() const;

  // For a saved state; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);

 private:
  struct Record {
    RegistrationEvidence evidence;
    bool is_accepted = false;
  };

  HealthOptions options_;
  std::deque<Record> records_;
};

}  // namespace mono3d
