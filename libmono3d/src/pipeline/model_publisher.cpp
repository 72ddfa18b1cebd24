// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/model_publisher.h"

#include <algorithm>
#include <utility>

#include "pipeline/clock.h"

namespace mono3d {
namespace {

constexpr double kMaxShareOfTime = 0.1;
// Later it would be newer when it is asked for, but might not be there in time.
constexpr double kShareOfPause = 0.5;

}  // namespace

PublishedModel ModelPublisher::Latest(std::uint64_t since_version) {
  const std::lock_guard lock(mutex_);
  const double now_s = Clock_s();
  pause_s_ = IsWanted() ? now_s - *asked_s_ : 0;
  asked_s_ = now_s;
  is_awaited_ = true;
  PublishedModel latest = latest_;
  for (const auto& [anchor, chunk] : chunks_) {
    if (chunk.version > since_version) latest.surfels.changed.push_back({anchor, chunk.surfels});
  }
  return latest;
}

bool ModelPublisher::IsWanted() const { return asked_s_ && Clock_s() - *asked_s_ < interest_s_; }

std::optional<double> ModelPublisher::Due_s() const {
  const std::lock_guard lock(mutex_);
  if (!IsWanted() || !is_awaited_ || !has_changed_) return std::nullopt;
  return std::max(earliest_s_, *asked_s_ + kShareOfPause * pause_s_);
}

// The next publication is of the whole model then.
void ModelPublisher::ForgetUnlessWanted() {
  const std::lock_guard lock(mutex_);
  if (IsWanted() || chunks_.empty()) return;
  chunks_.clear();
  model_ = nullptr;
  has_changed_ = true;
}

void ModelPublisher::PublishIfDue(SurfelMap& model, int map_id, const KeyframePosesPtr& poses) {
  ForgetUnlessWanted();
  const std::optional<double> due_s = Due_s();
  const double start_s = Clock_s();
  if (!due_s || *due_s > start_s) return;
  {
    const std::lock_guard lock(mutex_);
    is_awaited_ = false;  // who asks from now on waits for what comes from now on
  }
  const bool is_other_model = model_ != &model || latest_.map_id != map_id;
  model_ = &model;
  const SurfelChanges changes = model.ChangesSince(is_other_model ? 0 : model_version_);
  model_version_ = changes.version;
  has_changed_ = false;
  {
    const std::lock_guard lock(mutex_);
    Take(changes, is_other_model);
    latest_.map_id = map_id;
    latest_.poses = poses;
  }
  const double end_s = Clock_s();
  earliest_s_ = end_s + (end_s - start_s) * (1 / kMaxShareOfTime - 1);
}

void ModelPublisher::Take(const SurfelChanges& changes, bool is_other_model) {
  if (is_other_model) chunks_.clear();
  latest_.surfels.anchors = changes.anchors;
  const std::uint64_t version = ++latest_.surfels.version;
  for (const SurfelChunk& chunk : changes.changed) chunks_[chunk.anchor] = {version, chunk.surfels};
  std::map<std::uint32_t, Chunk> current;
  for (const SurfelAnchor& anchor : changes.anchors) {
    const auto known = chunks_.find(anchor.number);
    if (known != chunks_.end()) current.insert(chunks_.extract(known));
  }
  chunks_ = std::move(current);
}

}  // namespace mono3d
