// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/run_folder.h"

#include <charconv>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <system_error>
#include <utility>

#include "common/json_file.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/depth_image_file.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/image_file.h"
#include "mono3d/io/trajectory_file.h"
#include "mono3d/pipeline/reconstruction.h"
#include "view/small_picture.h"
#include "view/up_direction.h"

namespace mono3d::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kPictureWidth_px = 640;

// Nothing where it is not a list of so many numbers.
template <int kSize>
std::optional<Eigen::Matrix<double, kSize, 1>> NumbersOf(const nlohmann::json& json) {
  if (!json.is_array() || json.size() != kSize) return std::nullopt;
  Eigen::Matrix<double, kSize, 1> v;
  for (std::size_t i = 0; i < kSize; ++i) {
    if (!json[i].is_number()) return std::nullopt;
    v[static_cast<Eigen::Index>(i)] = json[i].get<double>();
  }
  if (!v.allFinite()) return std::nullopt;
  return v;
}

nlohmann::json RecordOrNothing(const fs::path& path) {
  nlohmann::json record = ReadJsonFile<nlohmann::json>(path);
  return record.is_object() ? record : nlohmann::json::object();
}

// Empty where it is no text.
std::string TextOf(const nlohmann::json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

// "000012.jpg" and "flight.mp4#12"
std::optional<std::int64_t> FrameNumberOf(const std::string& name) {
  const std::size_t hash = name.rfind('#');
  const std::string digits =
      hash == std::string::npos ? fs::path(name).stem().string() : name.substr(hash + 1);
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc() || end != digits.data() + digits.size() || number < 0) {
    return std::nullopt;
  }
  return number;
}

// The files of the input by name, with their positions; none where it is a video or not there.
std::map<std::string, std::pair<std::int64_t, fs::path>> ImagesOfInput(const std::string& input) {
  std::map<std::string, std::pair<std::int64_t, fs::path>> images;
  std::error_code ignored;
  if (input.empty() || fs::is_regular_file(input, ignored)) return images;
  try {
    std::int64_t number = 0;
    for (const std::string& path : ListImages(input)) {
      images[fs::path(path).filename().string()] = {number++, path};
    }
  } catch (const Error&) {  // it has moved
  }
  return images;
}

// Null where it cannot be read.
SharedBytes PictureOf(const fs::path& file, int interpolation) {
  try {
    return ToJpeg(SmallPicture(ReadImage(file), kPictureWidth_px, interpolation));
  } catch (const Error&) {
    return nullptr;
  }
}

// As many as there are decimals of it: "000012".
std::string SixDigits(std::int64_t number) {
  std::string digits = std::to_string(number);
  digits.insert(0, digits.size() < 6 ? 6 - digits.size() : 0, '0');
  return digits;
}

double Number(const nlohmann::json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_number() ? found->get<double>() : 0;
}

// As mono3d-reconstruct writes them to next_views.json; what is not so is left out.
std::vector<ViewProposal> NextViewsOf(const nlohmann::json& json) {
  constexpr std::size_t kMaxNextViews = 100;
  const auto views = json.find("views");
  if (views == json.end() || !views->is_array()) return {};
  const double surface_su2 = Number(json, "surface_su2");
  std::vector<ViewProposal> proposals;
  for (const nlohmann::json& view : *views) {
    if (!view.is_object() || proposals.size() == kMaxNextViews) break;
    const auto at = [&view](const char* name) { return view.value(name, nlohmann::json()); };
    const auto position = NumbersOf<3>(at("position")), target = NumbersOf<3>(at("target"));
    const auto rotation = NumbersOf<4>(at("rotation_xyzw"));
    const nlohmann::json explanation = at("explanation");
    if (!position || !target || !rotation || !explanation.is_string()) continue;
    if (!(rotation->norm() > 0.1)) continue;
    ViewProposal proposal;
    proposal.T_world_cam = Pose(Eigen::Quaterniond(*rotation), *position);
    proposal.target_world = *target;
    proposal.reason = explanation.get<std::string>();
    if (surface_su2 > 0) proposal.gain_share = Number(view, "gain_su2") / surface_su2;
    proposals.push_back(std::move(proposal));
  }
  return proposals;
}

}  // namespace

RunFolder::RunFolder(const fs::path& folder) : folder_(folder) {
  std::error_code ignored;
  if (!fs::exists(model_path(), ignored)) {
    const bool is_file = fs::is_regular_file(folder, ignored);
    throw Error(ErrorParts{.what = "there is no run with a model",
                           .where = folder.string(),
                           .expected = "the output folder of mono3d-reconstruct",
                           .found = is_file ? "a file: name its folder" : "no model.ply"});
  }
  record_ = RecordOrNothing(folder_ / "run.json");
  try {
    ReadKeyframes();
  } catch (const Error& error) {
    Log(LogLevel::kWarning, std::string(error.what()) + "; the keyframes are not shown");
  }
}

void RunFolder::ReadKeyframes() {
  std::error_code ignored;
  if (!fs::exists(folder_ / "sparse" / "images.txt", ignored)) return;
  const SparseModel sparse = ReadColmapModel(folder_ / "sparse");
  camera_ = sparse.camera;
  const auto images = ImagesOfInput(TextOf(record_, "input"));
  for (const SparseImage& image : sparse.images) {
    Keyframe keyframe;
    keyframe.T_world_cam = image.T_world_cam;
    const std::string name = fs::path(image.name).filename().string();
    const auto of_input = images.find(name);
    keyframe.image = folder_ / "images" / name;
    if (of_input != images.end()) {
      keyframe.frame_index = of_input->second.first;
      if (!fs::exists(keyframe.image, ignored)) keyframe.image = of_input->second.second;
    } else {
      keyframe.frame_index = FrameNumberOf(name).value_or(-1);
    }
    keyframes_.push_back(std::move(keyframe));
  }
}

nlohmann::json RunFolder::Status(std::int64_t num_surfels) const {
  nlohmann::json status = {{"phase", "file"},
                           {"name", fs::absolute(folder_).lexically_normal().string()},
                           {"surfels", num_surfels},
                           {"photos", IsOfPhotos()},
                           {"memory_mb", Number(record_, "peak_memory_bytes") / (1 << 20)}};
  if (const auto counts = record_.find("counts"); counts != record_.end() && counts->is_object()) {
    status["counts"] = {{"frames", Number(*counts, "frames")},
                        {"tracked", Number(*counts, "tracked") + Number(*counts, "recovered")},
                        {"keyframes", Number(*counts, "keyframes")},
                        {"bundles", Number(*counts, "bundles")},
                        {"dropped_bundles", Number(*counts, "bundles_dropped")},
                        {"depth_maps", Number(*counts, "depth_maps")},
                        {"fused", Number(*counts, "fused")}};
  }
  const nlohmann::json::json_pointer health("/maps/0/health");
  if (record_.contains(health) && record_[health].is_object()) {
    status["health"] = TextOf(record_[health], "state");
    status["health_reason"] = TextOf(record_[health], "reason");
  }
  if (const nlohmann::json earth = PlaceOnEarth(); !earth.is_null()) status["earth"] = earth;
  return status;
}

// The model is in metres.
nlohmann::json RunFolder::PlaceOnEarth() const {
  const nlohmann::json::json_pointer of("/maps/0/axes/of"), where("/maps/0/georeference");
  const bool is_on_earth = record_.contains(of) && record_[of] == ToString(AxesSource::kEarth) &&
                           record_.contains(where) && record_[where].is_object();
  if (!is_on_earth) return nullptr;
  const nlohmann::json& found = record_[where];
  nlohmann::json earth = {{"metres_per_unit", 1},
                          {"scale_sigma", Number(found, "scale_sigma")},
                          {"heading_sigma_deg", Number(found, "heading_sigma_deg")}};
  if (const auto sigma = found.find("position_sigma_m");
      sigma != found.end() && sigma->is_object()) {
    earth["position_sigma_m"] = std::hypot(Number(*sigma, "east"), Number(*sigma, "north"));
  }
  return earth;
}

// Their time stamps only number them.
bool RunFolder::IsOfPhotos() const {
  const auto found = record_.find("photos");
  return found != record_.end() && found->is_boolean() && found->get<bool>();
}

std::optional<Eigen::Vector3d> RunFolder::KnownUp() const {
  const nlohmann::json::json_pointer of("/maps/0/axes/of");
  if (!record_.contains(of) || !record_[of].is_string()) return std::nullopt;
  const std::string axes = record_[of].get<std::string>();
  bool is_level = axes == ToString(AxesSource::kLevel) || axes == ToString(AxesSource::kEarth);
  if (axes == ToString(AxesSource::kSavedMap)) {
    // Those of the first camera are not turned.
    const nlohmann::json::json_pointer w("/maps/0/axes/rotation/w");
    is_level = record_.contains(w) && record_[w].is_number() &&
               std::abs(record_[w].get<double>()) < 1 - 1e-12;
  }
  if (!is_level) return std::nullopt;
  return Eigen::Vector3d::UnitZ();
}

void RunFolder::Show(ViewStore& store, std::int64_t num_surfels,
                     std::span<const Eigen::Vector3f> normals) const {
  std::vector<ViewPose> keyframes, path;
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    keyframes.push_back(
        {.id = static_cast<std::int64_t>(i), .T_world_cam = keyframes_[i].T_world_cam});
    poses.push_back(keyframes_[i].T_world_cam);
  }
  std::error_code ignored;
  if (const fs::path file = folder_ / "trajectory.txt"; fs::exists(file, ignored)) {
    for (const StampedPose& pose : ReadTrajectory(file)) {
      path.push_back({static_cast<std::int64_t>(path.size()), pose.timestamp_s, pose.T_world_cam});
    }
  }
  if (poses.empty()) {
    for (const ViewPose& pose : path) poses.push_back(pose.T_world_cam);
  }
  if (camera_.width > 0) store.SetCamera(camera_);
  const std::optional<Eigen::Vector3d> up = KnownUp();
  store.SetUp(up ? *up : UpDirection(poses, normals));
  store.SetNextViews(NextViewsOf(RecordOrNothing(folder_ / "next_views.json")));
  store.SetKeyframes(std::move(keyframes));
  store.SetPath(std::move(path));
  store.SetStatus(Status(num_surfels));
  const nlohmann::json::json_pointer frames("/maps/0/model_frames");
  if (!IsOfPhotos() && record_.contains(frames) && record_[frames].is_object()) {
    const nlohmann::json& told = record_[frames];
    const auto time_of = [&told](const char* frame, const char* time) {
      return FrameTime{static_cast<std::int64_t>(Number(told, frame)), Number(told, time)};
    };
    store.SetTimes(time_of("first", "first_s"), time_of("last", "last_s"));
  }
}

SharedBytes RunFolder::Picture(const std::string& kind, std::int64_t keyframe) const {
  if (keyframe < 0 || keyframe >= static_cast<std::int64_t>(keyframes_.size())) return nullptr;
  const Keyframe& asked = keyframes_[static_cast<std::size_t>(keyframe)];
  const std::lock_guard lock(mutex_);
  if (kind == "image") return PictureOf(asked.image, cv::INTER_AREA);
  if (asked.frame_index < 0) return nullptr;
  const fs::path stem = folder_ / "depth" / (SixDigits(asked.frame_index) + ".depth");
  if (SharedBytes preview = PictureOf(stem.string() + ".png", cv::INTER_NEAREST)) return preview;
  for (const char* ending : {".pfm", ".exr", "16.png"}) {
    std::error_code ignored;
    const std::string file = stem.string() + ending;
    if (!fs::exists(file, ignored)) continue;
    const cv::Mat depth = SmallPicture(ReadDepthImage(file), kPictureWidth_px, cv::INTER_NEAREST);
    return ToJpeg(DepthPreview(depth));
  }
  return nullptr;
}

}  // namespace mono3d::tools
