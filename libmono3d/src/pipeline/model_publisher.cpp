// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/model_publisher.h"

#include <utility>

#include "pipeline/clock.h"

namespace mono3d {
namespace {

constexpr double kMaxShareOfTime = 0.1;

}  // namespace

PublishedModel ModelPublisher::Latest(std::uint64_t since_version) {
  const std::lock_guard lock(mutex_);
  is_wanted_ = true;
  PublishedModel latest = latest_;
  if (latest.version <= since_version) latest.surfels = nullptr;
  return latest;
}

std::optional<double> ModelPublisher::Due_s() const {
  const std::lock_guard lock(mutex_);
  if (!is_wanted_ || !has_changed_) return std::nullopt;
  return earliest_s_;
}

void ModelPublisher::PublishIfDue(const std::function<PublishedModel()>& make) {
  const std::optional<double> due_s = Due_s();
  const double start_s = Clock_s();
  if (!due_s || *due_s > start_s) return;
  PublishedModel made = make();
  has_changed_ = false;
  const double end_s = Clock_s();
  earliest_s_ = end_s + (end_s - start_s) * (1 / kMaxShareOfTime - 1);
  const std::lock_guard lock(mutex_);
  made.version = latest_.version + 1;
  latest_ = std::move(made);
}

}  // namespace mono3d
