// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/view_store.h"

#include <algorithm>
#include <random>
#include <set>
#include <utility>

#include "mono3d/core/timing.h"

namespace mono3d::tools {
namespace {

// Of small JPEG files: a thousand keyframes and more.
constexpr std::size_t kMaxKeyframePictureBytes = 64U << 20;

nlohmann::json VectorToJson(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::json PosesToJson(const std::vector<ViewPose>& poses) {
  nlohmann::json list = nlohmann::json::array();
  for (const ViewPose& pose : poses) {
    list.push_back(
        {{"id", pose.id}, {"t", pose.timestamp_s}, {"pose", PoseNumbers(pose.T_world_cam)}});
  }
  return list;
}

}  // namespace

nlohmann::json PoseNumbers(const Pose& pose) {
  const Eigen::Vector3d& t = pose.translation();
  const Eigen::Quaterniond& q = pose.rotation();
  nlohmann::json numbers = nlohmann::json::array();
  for (const double v : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    numbers.push_back(static_cast<float>(v));
  }
  return numbers;
}

ViewStore::ViewStore() : server_(std::random_device()()) {}

void ViewStore::SetModel(const std::vector<std::int64_t>& ids, std::vector<SurfelBlock> changed) {
  const std::set<std::int64_t> kept(ids.begin(), ids.end());
  const std::lock_guard lock(mutex_);
  ++version_;
  const std::size_t num_gone =
      std::erase_if(blocks_, [&](const auto& entry) { return !kept.contains(entry.first); });
  if (num_gone > 0) ids_version_ = version_;
  for (SurfelBlock& block : changed) {
    if (!kept.contains(block.id)) continue;
    Entry& entry = blocks_[block.id];
    entry = {std::move(block), version_, version_};
  }
}

void ViewStore::SetTransforms(const std::map<std::int64_t, Similarity>& S_world_block) {
  const std::lock_guard lock(mutex_);
  ++version_;
  for (auto& [id, entry] : blocks_) {
    const auto found = S_world_block.find(id);
    if (found == S_world_block.end()) continue;
    Similarity& S = entry.block.S_world_block;
    const Similarity& now = found->second;
    if (S.scale() == now.scale() && S.pose().translation() == now.pose().translation() &&
        S.pose().rotation().coeffs() == now.pose().rotation().coeffs()) {
      continue;
    }
    S = now;
    entry.transform_version = version_;
  }
}

void ViewStore::Set(const std::string& name, nlohmann::json value) {
  const std::lock_guard lock(mutex_);
  Versioned& versioned = values_[name];
  if (versioned.version > 0 && versioned.value == value) return;
  versioned = {std::move(value), ++version_};
}

void ViewStore::SetKeyframes(std::vector<ViewPose> keyframes) {
  Set("keyframes", PosesToJson(keyframes));
}

void ViewStore::SetPath(std::vector<ViewPose> path) { Set("path", PosesToJson(path)); }

void ViewStore::SetCamera(const CameraModel& camera) {
  Set("camera", {{"width", camera.width},
                 {"height", camera.height},
                 {"fx", camera.fx},
                 {"fy", camera.fy},
                 {"cx", camera.cx},
                 {"cy", camera.cy}});
}

void ViewStore::SetUp(const Eigen::Vector3d& up) { Set("up", VectorToJson(up.cast<float>())); }

void ViewStore::SetNextViews(const std::vector<ViewProposal>& next_views) {
  nlohmann::json list = nlohmann::json::array();
  for (const ViewProposal& view : next_views) {
    list.push_back({{"pose", PoseNumbers(view.T_world_cam)},
                    {"target", VectorToJson(view.target_world.cast<float>())},
                    {"reason", view.reason},
                    {"gain_share", view.gain_share}});
  }
  Set("next_views", std::move(list));
}

void ViewStore::SetTimes(const FrameTime& first, const FrameTime& last) {
  Set("times", {{"frames", {first.frame_index, last.frame_index}},
                {"seconds", {first.timestamp_s, last.timestamp_s}}});
}

void ViewStore::SetErrors(double largest_m) { Set("errors", {{"largest_m", largest_m}}); }

void ViewStore::SetStatus(nlohmann::json status) { Set("status", std::move(status)); }

void ViewStore::SetPicture(const std::string& kind, SharedBytes jpeg) {
  const std::lock_guard lock(mutex_);
  ++version_;
  pictures_[kind] = std::move(jpeg);
  values_["picture_" + kind] = {version_, version_};
}

void ViewStore::SetPictureOfKeyframe(const std::string& kind, std::int64_t keyframe_id,
                                     SharedBytes jpeg) {
  const std::lock_guard lock(mutex_);
  SharedBytes& kept = keyframe_pictures_[{keyframe_id, kind}];
  if (kept) keyframe_picture_bytes_ -= kept->size();
  keyframe_picture_bytes_ += jpeg->size();
  kept = std::move(jpeg);
  while (keyframe_picture_bytes_ > kMaxKeyframePictureBytes) {
    keyframe_picture_bytes_ -= keyframe_pictures_.begin()->second->size();
    keyframe_pictures_.erase(keyframe_pictures_.begin());
  }
}

std::string ViewStore::Changes(std::uint64_t since) const {
  nlohmann::json json;
  const std::lock_guard lock(mutex_);
  asked_at_ms_ = WallClockMs();
  json["server"] = server_;
  json["version"] = version_;
  for (const auto& [name, versioned] : values_) {
    if (versioned.version > since) json[name] = versioned.value;
  }
  nlohmann::json& list = json["blocks"] = nlohmann::json::array();
  for (const auto& [id, entry] : blocks_) {
    if (entry.version <= since && entry.transform_version <= since) continue;
    const SurfelBlock& block = entry.block;
    nlohmann::json& told = list.emplace_back();
    told = {{"id", id},
            {"version", entry.version},
            {"surfels", block.num_surfels()},
            {"low", VectorToJson(block.low)},
            {"high", VectorToJson(block.high)},
            {"max_radius", block.max_radius},
            {"scale", block.S_world_block.scale()},
            {"pose", PoseNumbers(block.S_world_block.pose())}};
    if (block.frames) told["frames"] = {block.frames->first, block.frames->last};
  }
  if (ids_version_ > since) {
    nlohmann::json& ids = json["ids"] = nlohmann::json::array();
    for (const auto& [id, entry] : blocks_) ids.push_back(id);
  }
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::optional<std::string> ViewStore::Surfels(std::int64_t id, std::uint64_t first,
                                              std::uint64_t count) const {
  Entry entry;
  {
    const std::lock_guard lock(mutex_);
    const auto found = blocks_.find(id);
    if (found == blocks_.end()) return std::nullopt;
    entry = found->second;  // shares the surfels
  }
  const SurfelBlock& block = entry.block;
  const auto size = static_cast<std::uint64_t>(block.num_surfels());
  first = std::min(first, size);
  std::string bytes;
  const auto append = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  append(static_cast<double>(entry.version));
  for (const Eigen::Vector3f& bound : {block.low, block.high}) {
    for (int k = 0; k < 3; ++k) append(bound[k]);
  }
  append(block.max_radius);
  append(static_cast<std::uint32_t>(size));
  // The last one before the first: not known.
  append(block.frames ? block.frames->first : 1U);
  append(block.frames ? block.frames->last : 0U);
  bytes.append(*block.surfels, first * kBytesOfSurfel,
               std::min(count, size - first) * kBytesOfSurfel);
  return bytes;
}

SharedBytes ViewStore::Picture(const std::string& kind) const {
  const std::lock_guard lock(mutex_);
  const auto found = pictures_.find(kind);
  return found == pictures_.end() ? nullptr : found->second;
}

SharedBytes ViewStore::PictureOfKeyframe(const std::string& kind, std::int64_t keyframe_id) const {
  const std::lock_guard lock(mutex_);
  const auto found = keyframe_pictures_.find({keyframe_id, kind});
  return found == keyframe_pictures_.end() ? nullptr : found->second;
}

double ViewStore::SecondsSinceAsked() const {
  const std::lock_guard lock(mutex_);
  return asked_at_ms_ ? 1e-3 * (WallClockMs() - *asked_at_ms_) : kNeverAsked_s;
}

}  // namespace mono3d::tools
