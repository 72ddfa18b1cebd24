// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/map/map_bytes.h"

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <set>
#include <utility>

#include "core/byte_archive.h"
#include "mono3d/core/error.h"
#include "tracking/features/feature_grid.h"
#include "tracking/map/map_checks.h"

namespace mono3d::tracking {
namespace {

constexpr std::string_view kMagic = "mono3d map\n";
constexpr std::uint32_t kVersion = 6;
constexpr const char* kWhat = "saved map";  // in messages

template <typename Archive>
constexpr bool kReads = std::same_as<Archive, ByteReader>;

template <typename Archive>
void ExchangeIndex(Archive& archive, std::size_t& index) {
  std::uint64_t number = index;
  archive.Number(number);
  index = number;
}

// All points of a loaded map are the first ones in their places.
template <typename Archive>
void ExchangePoint(Archive& archive, PointId& point) {
  std::uint64_t number = point.index;
  archive.Number(number);
  if constexpr (kReads<Archive>) {
    if (number > std::numeric_limits<std::uint32_t>::max()) archive.Refuse("a number is too large");
    point = {static_cast<std::uint32_t>(number), 0};
  }
}

template <typename Archive, typename Matrix>
void ExchangeMatrix(Archive& archive, Matrix& matrix) {
  for (Eigen::Index i = 0; i < matrix.size(); ++i) archive.Number(matrix.data()[i]);
}

template <typename Archive>
void Exchange(Archive& archive, Pose& pose) {
  Eigen::Vector4d q = pose.rotation().coeffs();
  Eigen::Vector3d t = pose.translation();
  ExchangeMatrix(archive, q);
  ExchangeMatrix(archive, t);
  if constexpr (kReads<Archive>) {
    if (!(std::abs(q.norm() - 1) < 1e-6)) archive.Refuse("a rotation is none");
    pose = Pose(Eigen::Quaterniond(q), t);
  }
}

template <typename Archive>
void Exchange(Archive& archive, CameraModel& camera) {
  archive.Number(camera.width);
  archive.Number(camera.height);
  for (double* number : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) archive.Number(*number);
  for (double& coefficient : camera.distortion) archive.Number(coefficient);
  archive.Number(camera.shutter.readout_s);
  archive.Number(camera.shutter.reads_columns);
  bool is_fisheye = camera.lens == LensModel::kFisheye;
  archive.Number(is_fisheye);
  camera.lens = is_fisheye ? LensModel::kFisheye : LensModel::kBrown;
}

template <typename Archive>
void Exchange(Archive& archive, FeatureOptions& options) {
  for (int* number : {&options.num_features, &options.num_levels, &options.fast_threshold,
                      &options.min_fast_threshold}) {
    archive.Number(*number);
  }
  archive.Number(options.scale_factor);
}

template <typename Archive>
void Exchange(Archive& archive, Feature& feature) {
  ExchangeMatrix(archive, feature.pixel);
  archive.Number(feature.level);
  for (double* number : {&feature.angle_deg, &feature.response, &feature.sigma_px}) {
    archive.Number(*number);
  }
  for (std::uint64_t& word : feature.descriptor) archive.Number(word);
}

template <typename Archive>
void Exchange(Archive& archive, Patch& patch) {
  ExchangeMatrix(archive, patch.pixel);
  archive.Number(patch.octave);
  ExchangeMatrix(archive, patch.centre);
  for (std::uint8_t& grey : patch.grey) archive.Number(grey);
  ExchangeMatrix(archive, patch.normal.value);
  ExchangeMatrix(archive, patch.normal.information);
}

template <typename Archive>
void Exchange(Archive& archive, MapPoint& point) {
  archive.Number(point.alive);
  ExchangeMatrix(archive, point.p_world);
  archive.Number(point.depth_sigma);
  archive.List(point.observations, [&](Observation& observation) {
    ExchangeIndex(archive, observation.keyframe);
    ExchangeIndex(archive, observation.feature);
  });
  ExchangeIndex(archive, point.created_at);
  archive.Number(point.num_predicted);
  archive.Number(point.num_found);
  archive.Optional(point.patch, [&](Patch& patch) { Exchange(archive, patch); });
  ExchangeIndex(archive, point.patch_keyframe);
  for (std::uint8_t& channel : point.colour) archive.Number(channel);
  for (std::uint64_t& word : point.descriptor) archive.Number(word);
  ExchangeMatrix(archive, point.towards_cameras);
  archive.Number(point.min_distance);
  archive.Number(point.max_distance);
}

template <typename Archive>
void Exchange(Archive& archive, ShutterMotion& shutter) {
  CameraVelocity velocity = shutter.velocity();
  for (Eigen::Vector3d* axes : {&velocity.angular_rad_per_s, &velocity.linear_su_per_s,
                                &velocity.angular_rad_per_s2, &velocity.linear_su_per_s2}) {
    ExchangeMatrix(archive, *axes);
  }
  if constexpr (kReads<Archive>) shutter = {{}, velocity};  // the sensor is that of all keyframes
}

template <typename Archive>
void Exchange(Archive& archive, MapKeyframe& keyframe) {
  View& view = keyframe.view;
  archive.Number(view.frame.index);
  archive.Number(view.frame.timestamp_s);
  archive.Text(view.frame.name);
  archive.List(view.features, [&](Feature& feature) { Exchange(archive, feature); });
  archive.List(view.points, [&](std::optional<PointId>& point) {
    archive.Optional(point, [&](PointId& id) { ExchangePoint(archive, id); });
  });
  Exchange(archive, view.T_cam_world);
  Exchange(archive, view.shutter);
  archive.Number(keyframe.id);
  archive.Number(keyframe.alive);
  archive.Number(keyframe.num_newer_adjusted);
  archive.Number(keyframe.is_finalised);
  archive.Number(keyframe.scale);
  ExchangeIndex(archive, keyframe.anchor);
  Exchange(archive, keyframe.T_cam_anchor);
}

template <typename Archive>
void Exchange(Archive& archive, FrameRecord& record) {
  archive.Number(record.frame_index);
  archive.Number(record.timestamp_s);
  ExchangeIndex(archive, record.keyframe);
  Exchange(archive, record.T_cam_keyframe);
}

// All of it.
struct Content {
  CameraModel camera;
  CameraModel sensor;  // width 0: a global shutter
  FeatureOptions features;
  std::vector<MapPoint> points;
  std::vector<MapKeyframe> keyframes;
  std::vector<FrameRecord> frames;
};

template <typename Archive>
void Exchange(Archive& archive, Content& content) {
  Exchange(archive, content.camera);
  Exchange(archive, content.sensor);
  Exchange(archive, content.features);
  archive.List(content.points, [&](MapPoint& point) { Exchange(archive, point); });
  archive.List(content.keyframes, [&](MapKeyframe& keyframe) { Exchange(archive, keyframe); });
  archive.List(content.frames, [&](FrameRecord& frame) { Exchange(archive, frame); });
}

std::uint64_t Checksum(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037U;  // FNV-1a
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return hash;
}

// Points and keyframes must refer to each other, both ways, and to nothing else.
bool ObservationsAgree(const Content& content) {
  std::size_t num_observations = 0;
  for (std::size_t id = 0; id < content.points.size(); ++id) {
    const std::vector<Observation>& observations = content.points[id].observations;
    // Twice the same one would stand for one of a point that is not there.
    const auto is_not_later = [](const Observation& a, const Observation& b) {
      return a.keyframe >= b.keyframe;
    };
    if (std::ranges::adjacent_find(observations, is_not_later) != observations.end()) return false;
    if (!content.points[id].alive && !observations.empty()) return false;
    for (const Observation& seen : observations) {
      if (seen.keyframe >= content.keyframes.size()) return false;
      const View& view = content.keyframes[seen.keyframe].view;
      if (seen.feature >= view.points.size() ||
          view.points[seen.feature] != PointId{static_cast<std::uint32_t>(id), 0})
        return false;
      ++num_observations;
    }
  }
  for (const MapKeyframe& keyframe : content.keyframes) {
    if (keyframe.view.points.size() != keyframe.view.features.size()) return false;
    for (const std::optional<PointId>& point : keyframe.view.points) {
      if (!point) continue;
      if (num_observations == 0) return false;
      --num_observations;
    }
  }
  return num_observations == 0;
}

// What is counted further, as int.
bool IsCount(int count) { return count >= 0 && count <= 1'000'000'000; }

bool AreFeatureOptions(const FeatureOptions& features) {
  constexpr int kMaxLevels = 64;
  return features.num_levels >= 1 && features.num_levels <= kMaxLevels &&
         features.scale_factor > 1 && features.scale_factor <= 2 && IsCount(features.num_features);
}

// The grid of a keyframe takes memory by the size of the image: not much more than what is saved.
bool IsImageSizePlausible(const Content& content, std::size_t num_bytes) {
  constexpr double kMaxPixels = 1 << 28;
  constexpr double kPixelsOfCell = 32 * 32;
  constexpr double kMaxCellsOfByte = 16;
  constexpr double kMaxCellsOfSmallMap = 1 << 24;
  const double num_pixels = double{1} * content.camera.width * content.camera.height;
  const double num_cells =
      num_pixels / kPixelsOfCell * static_cast<double>(content.keyframes.size());
  return num_pixels <= kMaxPixels &&
         num_cells <= kMaxCellsOfByte * static_cast<double>(num_bytes) + kMaxCellsOfSmallMap;
}

bool KeyframesAgree(const Content& content) {
  constexpr std::int64_t kMaxId = std::int64_t{1} << 53;
  for (const MapPoint& point : content.points) {
    if (!IsCount(point.num_predicted) || !IsCount(point.num_found)) return false;
    if (point.patch_keyframe >= content.keyframes.size()) return false;
    if (point.patch && (point.patch->octave < 0 || point.patch->octave >= kNumOctaves))
      return false;
    if (point.alive && point.observations.empty()) return false;
    if (!(point.depth_sigma >= 0)) return false;
  }
  std::set<std::int64_t> ids;
  for (std::size_t id = 0; id < content.keyframes.size(); ++id) {
    const MapKeyframe& keyframe = content.keyframes[id];
    if (!ids.insert(keyframe.id).second || keyframe.id < 0 || keyframe.id > kMaxId) return false;
    if (!IsCount(keyframe.num_newer_adjusted) || keyframe.scale <= 0) return false;
    if (!keyframe.alive && keyframe.anchor >= content.keyframes.size()) return false;
    // The anchors of culled keyframes lead to one that is alive.
    std::size_t at = id;
    for (std::size_t steps = 0; !content.keyframes[at].alive; ++steps) {
      at = content.keyframes[at].anchor;
      if (at >= content.keyframes.size() || steps > content.keyframes.size()) return false;
    }
    for (const Feature& feature : keyframe.view.features) {
      if (!IsFeatureOf(content.camera, content.features.num_levels, feature)) return false;
    }
  }
  for (const FrameRecord& frame : content.frames) {
    if (frame.keyframe >= content.keyframes.size()) return false;
  }
  return !content.keyframes.empty();
}

}  // namespace

std::string ToBytes(const Map& map, const FeatureOptions& features,
                    const std::vector<FrameRecord>& frames) {
  CameraModel sensor;
  if (!map.keyframes().empty()) sensor = map.keyframe(0).view.frame.sensor;
  Content content{map.camera(), sensor, features, map.points(), map.keyframes(), frames};
  ByteWriter writer;
  std::uint32_t version = kVersion;
  writer.Number(version);
  Exchange(writer, content);
  return WithChecksum(std::string(kMagic) + writer.TakeBytes());
}

std::string WithChecksum(std::string bytes) {
  ByteWriter end;
  std::uint64_t checksum = Checksum(bytes);
  end.Number(checksum);
  return std::move(bytes) + end.TakeBytes();
}

SavedMap FromBytes(std::string_view bytes, const std::string& where) {
  ByteReader all(bytes, kWhat, where);
  if (!bytes.starts_with(kMagic)) all.Refuse("not one of mono3d; --save-map writes one");
  ByteReader reader(bytes.substr(kMagic.size()), kWhat, where);
  std::uint32_t version = 0;
  reader.Number(version);
  if (version != kVersion) {
    throw Error(ErrorParts{.what = "saved map: of another version; make it again from its images "
                                   "with --save-map, or use the mono3d that wrote it",
                           .where = where,
                           .expected = "version " + std::to_string(kVersion),
                           .found = "version " + std::to_string(version)});
  }
  std::uint64_t checksum = 0;
  if (bytes.size() < kMagic.size() + sizeof(version) + sizeof(checksum)) {
    all.Refuse("ends too early");
  }
  const std::string_view checked = bytes.substr(0, bytes.size() - sizeof(checksum));
  ByteReader(bytes.substr(checked.size()), kWhat, where).Number(checksum);
  if (checksum != Checksum(checked)) all.Refuse("damaged: cut off or changed");
  reader = ByteReader(checked.substr(kMagic.size() + sizeof(version)), kWhat, where);
  Content content;
  Exchange(reader, content);
  Validate(content.camera, where);
  if (!reader.IsAtEnd() || !AreFeatureOptions(content.features) ||
      !IsImageSizePlausible(content, bytes.size()) || !ObservationsAgree(content) ||
      !KeyframesAgree(content)) {
    all.Refuse("contradicts itself");
  }
  if (content.sensor.width != 0) Validate(content.sensor, where);
  for (MapKeyframe& keyframe : content.keyframes) {
    keyframe.is_finalised = true;
    keyframe.view.frame.camera = content.camera;
    keyframe.view.frame.sensor = content.sensor;
    keyframe.view.shutter = {content.sensor, keyframe.view.shutter.velocity()};
    keyframe.view.grid =
        FeatureGrid(keyframe.view.features, content.camera.width, content.camera.height);
  }
  SavedMap saved{content.features, nullptr, std::move(content.frames)};
  saved.map = std::make_unique<Map>(0, content.camera, content.features, std::move(content.points),
                                    std::move(content.keyframes));
  return saved;
}

}  // namespace mono3d::tracking
