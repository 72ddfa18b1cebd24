// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mono3d/core/error.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {
namespace {

void ExpectRefused(const SurfelMapOptions& options, const std::string& name) {
  try {
    options.Validate();
    FAIL() << name << " was accepted";
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr(name));
  }
}

TEST(SurfelMapOptions, DefaultsAreValid) { EXPECT_NO_THROW(SurfelMapOptions{}.Validate()); }

TEST(SurfelMapOptions, NamesTheOptionThatIsOutOfRange) {
  SurfelMapOptions options;
  options.association.matching_error_px = 0;
  ExpectRefused(options, "association.matching_error_px");
  options = {};
  options.association.max_sigmas = -1;
  ExpectRefused(options, "association.max_sigmas");
  options = {};
  options.association.max_normal_angle_deg = 181;
  ExpectRefused(options, "association.max_normal_angle_deg");
  options = {};
  options.free_space.min_sigmas = 2;  // what may be one surface cannot be free space
  ExpectRefused(options, "free_space.min_sigmas");
  options = {};
  options.registration.prior_px = 0;
  ExpectRefused(options, "registration.prior_px");
  options = {};
  options.gate.min_overlap = 0;
  ExpectRefused(options, "gate.min_overlap");
  options = {};
  options.gate.min_agreement = 1.1;
  ExpectRefused(options, "gate.min_agreement");
  options = {};
  options.gate.max_residual = 0;
  ExpectRefused(options, "gate.max_residual");
  options = {};
  options.num_reviews = -1;
  ExpectRefused(options, "num_reviews");
  options = {};
  options.storage.max_device_mb = -1;
  ExpectRefused(options, "storage.max_device_mb");
  options = {};
  options.storage.max_host_mb = -1;
  ExpectRefused(options, "storage.max_host_mb");
  options = {};
  options.max_surfels = 0;
  ExpectRefused(options, "max_surfels");
}

TEST(SurfelMapOptions, ListsEveryField) {
  SurfelMapOptions options;
  std::vector<std::string> names;
  for (const OptionField& field : ListOptions(options)) names.push_back(field.name);
  EXPECT_THAT(
      names,
      ::testing::ElementsAre(
          "association.matching_error_px", "association.max_sigmas",
          "association.max_normal_angle_deg", "free_space.min_sigmas", "registration.enabled",
          "registration.moves", "registration.with_scale", "registration.with_grey",
          "registration.max_misfit", "registration.prior_px", "registration.prior_scale",
          "registration.grey_noise", "registration.grey_shift_px", "gate.min_overlap",
          "gate.min_agreement", "gate.max_contradiction", "gate.max_residual",
          "gate.max_grey_residual", "gate.max_noise", "gate.max_deviation_px",
          "gate.max_scale_deviation", "gate.max_join_uncertainty_px", "retry.max_waiting",
          "retry.max_attempts", "retry.num_recent", "health.num_registrations",
          "health.min_registrations", "health.min_accepted_share", "health.good_accepted_share",
          "health.max_moved_share", "health.max_depth_residual", "health.max_scale_drift",
          "storage.max_device_mb", "storage.max_host_mb", "storage.folder", "with_confidence",
          "num_reviews", "max_surfels"));
}

}  // namespace
}  // namespace mono3d
