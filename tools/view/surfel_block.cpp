// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/surfel_block.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <random>

namespace mono3d::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "the page reads little endian");

struct EncodedSurfel {
  std::uint16_t position[3];
  std::uint8_t radius;
  std::uint8_t frame;
  std::int8_t normal[2];
  std::uint8_t observations;
  std::uint8_t error;
  std::uint8_t colour[3];
  std::uint8_t confidence;
};
static_assert(sizeof(EncodedSurfel) == kBytesOfSurfel);

// `share` of 0 to 1.
std::uint16_t ToUint16(float share) {
  return static_cast<std::uint16_t>(std::lround(65535 * std::clamp(share, 0.0F, 1.0F)));
}

std::uint8_t ToUint8(float share) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0F, 1.0F)));
}

// Steps of a twentieth of an octave tell radii apart by 3.5 %, and reach from the largest one down
// to a 6600th of it.
std::uint8_t EncodeRadius(float share) {
  constexpr float kStepsPerOctave = 20;
  if (!(share > 0)) return 1;  // not 0: the smallest is still there
  const float steps = std::clamp(-kStepsPerOctave * std::log2(share), 0.0F, 254.0F);
  return static_cast<std::uint8_t>(255 - std::lround(steps));
}

std::uint8_t EncodeFrame(std::uint32_t frame, const FrameRange& frames) {
  if (frames.last <= frames.first) return 0;
  const double share = (static_cast<double>(frame) - frames.first) / (frames.last - frames.first);
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0, 1.0)));
}

// The normal's place on an octahedron that is unfolded to a square: two bytes, off by less than a
// degree.
void EncodeNormal(const Eigen::Vector3f& normal, std::int8_t* to) {
  const float sum = normal.cwiseAbs().sum();
  if (!(sum > 0)) {
    to[0] = to[1] = -128;
    return;
  }
  Eigen::Vector2f flat = normal.head<2>() / sum;
  if (normal.z() < 0) {
    const Eigen::Vector2f folded =
        Eigen::Vector2f::Ones() - Eigen::Vector2f(flat.y(), flat.x()).cwiseAbs();
    flat = {std::copysign(folded.x(), flat.x()), std::copysign(folded.y(), flat.y())};
  }
  for (int k = 0; k < 2; ++k) to[k] = static_cast<std::int8_t>(std::lround(127 * flat[k]));
}

}  // namespace

void EncodeSurfel(const ViewSurfel& surfel, const SurfelBlock& block, char* to) {
  EncodedSurfel encoded = {};
  for (int k = 0; k < 3; ++k) {
    const float size = block.high[k] - block.low[k];
    encoded.position[k] = size > 0 ? ToUint16((surfel.point[k] - block.low[k]) / size) : 0;
    encoded.colour[k] = surfel.colour[static_cast<std::size_t>(k)];
  }
  EncodeNormal(surfel.normal, encoded.normal);
  if (block.max_radius > 0) encoded.radius = EncodeRadius(surfel.radius / block.max_radius);
  if (block.frames && surfel.first_frame) {
    encoded.frame = EncodeFrame(*surfel.first_frame, *block.frames);
  }
  encoded.observations = static_cast<std::uint8_t>(std::min(surfel.observations, 255U));
  encoded.error = ToUint8(surfel.error);
  encoded.confidence = ToUint8(surfel.confidence);
  std::memcpy(to, &encoded, sizeof encoded);
}

bool IsFinite(const ViewSurfel& surfel) {
  return surfel.point.allFinite() && surfel.normal.allFinite() && std::isfinite(surfel.radius) &&
         surfel.radius >= 0;
}

void ShuffleSurfels(std::string& bytes) {
  std::mt19937 random(20251123);
  std::array<char, kBytesOfSurfel> kept = {};
  for (std::size_t i = bytes.size() / kBytesOfSurfel; i > 1; --i) {
    char* last = bytes.data() + (i - 1) * kBytesOfSurfel;
    char* other = bytes.data() + random() % i * kBytesOfSurfel;
    std::memcpy(kept.data(), last, kBytesOfSurfel);
    std::memmove(last, other, kBytesOfSurfel);
    std::memcpy(other, kept.data(), kBytesOfSurfel);
  }
}

void SurfelBlock::Cover(const ViewSurfel& surfel, bool is_first_of_all) {
  if (is_first_of_all) low = high = surfel.point;
  low = low.cwiseMin(surfel.point);
  high = high.cwiseMax(surfel.point);
  max_radius = std::max(max_radius, surfel.radius);
  if (!surfel.first_frame) return;
  const std::uint32_t frame = *surfel.first_frame;
  if (!frames) frames = {frame, frame};
  frames->first = std::min(frames->first, frame);
  frames->last = std::max(frames->last, frame);
}

SurfelBlock MakeSurfelBlock(std::vector<ViewSurfel> surfels) {
  std::erase_if(surfels, [](const ViewSurfel& surfel) { return !IsFinite(surfel); });
  SurfelBlock block;
  for (const ViewSurfel& surfel : surfels) block.Cover(surfel, &surfel == &surfels.front());
  std::string bytes(surfels.size() * kBytesOfSurfel, '\0');
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    EncodeSurfel(surfels[i], block, bytes.data() + i * kBytesOfSurfel);
  }
  ShuffleSurfels(bytes);
  block.surfels = std::make_shared<const std::string>(std::move(bytes));
  return block;
}

std::vector<ViewSurfel> ToViewSurfels(const PointCloud& cloud, double min_confidence) {
  std::vector<ViewSurfel> surfels;
  surfels.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    ViewSurfel surfel;
    if (!cloud.confidences.empty()) surfel.confidence = cloud.confidences[i];
    if (surfel.confidence < min_confidence) continue;
    surfel.point = cloud.points[i];
    if (!cloud.normals.empty()) surfel.normal = cloud.normals[i];
    if (!cloud.radii.empty()) surfel.radius = cloud.radii[i];
    if (!cloud.colours.empty()) surfel.colour = cloud.colours[i];
    if (!cloud.observations.empty()) surfel.observations = cloud.observations[i];
    if (!cloud.first_frames.empty()) surfel.first_frame = cloud.first_frames[i];
    surfels.push_back(surfel);
  }
  return surfels;
}

}  // namespace mono3d::tools
