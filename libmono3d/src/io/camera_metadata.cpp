// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/camera_metadata.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>

#include "io/exif_camera.h"
#include "io/image_file.h"
#include "io/image_list.h"
#include "io/image_metadata.h"
#include "io/image_source.h"
#include "io/photo_prior.h"
#include "io/video_prior.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/frame_source.h"

namespace mono3d {
namespace {

// Photos with metadata of one camera are alike: where this many have nothing usable, none has.
// Keeps warnings of them few.
constexpr std::size_t kMaxTries = 10;

// Decodes the file where nothing else tells its size.
void FindSize(const std::string& photo, PhotoFacts& facts) {
  if (facts.width > 0 && facts.height > 0) return;
  const cv::Size size = ReadImage(photo).size();
  facts.width = size.width;
  facts.height = size.height;
}

PhotoFacts ReadPhotoFactsAndSize(const std::string& photo) {
  PhotoFacts facts = ReadPhotoFacts(photo);
  FindSize(photo, facts);
  return facts;
}

// The first photo's that tells something of its camera; otherwise the default of the first that can
// be read.
CameraPrior PriorOfImages(const std::string& input, const std::vector<std::string>& images) {
  std::optional<CameraPrior> prior_of_size;
  std::size_t num_tries = 0;
  for (const std::string& image : images) {
    try {
      PhotoFacts facts = ReadPhotoFacts(image);
      if (prior_of_size && !facts.HasMetadata()) continue;  // nothing new
      FindSize(image, facts);
      if (const std::optional<CameraPrior> prior = PriorFromFacts(facts)) return *prior;
      if (!prior_of_size) prior_of_size = DefaultCameraPrior(facts.width, facts.height);
      if (facts.HasMetadata() && ++num_tries == kMaxTries) break;
    } catch (const Error& error) {
      Log(LogLevel::kWarning, std::string("no camera from: ") + error.what());
    }
  }
  if (prior_of_size) return *prior_of_size;
  throw Error(ErrorParts{.what = "not one image can be read",
                         .where = input,
                         .expected = {},
                         .found = std::to_string(images.size()) + " unreadable"});
}

// What a photo is grouped by, beside its image size.
struct CameraIdentity {
  std::string make;
  std::string model;
  std::string serial;
  std::string lens;
  double focal_mm = 0;
  double focal_35mm = 0;
  double digital_zoom = 1;

  explicit CameraIdentity(const PhotoFacts& facts) : serial(facts.Serial()) {
    if (!facts.exif) return;
    make = facts.exif->make;
    model = facts.exif->model;
    lens = facts.exif->lens;
    focal_mm = facts.exif->focal_mm;
    focal_35mm = facts.exif->focal_35mm;
    digital_zoom = facts.exif->digital_zoom;
  }

  bool IsKnown() const {
    return !make.empty() || !model.empty() || !serial.empty() || focal_mm > 0 || focal_35mm > 0;
  }

  bool IsSame(const CameraIdentity& other) const {
    return make == other.make && model == other.model && serial == other.serial &&
           lens == other.lens && HasSameFocal(other);
  }

 private:
  bool HasSameFocal(const CameraIdentity& other) const {
    constexpr double kSame = 0.01;  // a zoom lens is read off to about this
    const auto is_same = [](double a, double b) {
      return std::abs(a - b) <= kSame * std::max(a, b);
    };
    if (!is_same(digital_zoom, other.digital_zoom)) return false;
    // In whole mm, that of 35 mm film is coarser, and told where the other one is not.
    if (focal_mm > 0 && other.focal_mm > 0) return is_same(focal_mm, other.focal_mm);
    return is_same(focal_mm, other.focal_mm) && is_same(focal_35mm, other.focal_35mm);
  }
};

struct IdentifiedPhoto {
  std::string image;
  PhotoFacts facts;
  CameraIdentity identity;

  bool HasSizeOf(const IdentifiedPhoto& other) const {
    return facts.width == other.facts.width && facts.height == other.facts.height;
  }
};

std::vector<IdentifiedPhoto> IdentifyPhotos(const std::vector<std::string>& images) {
  std::vector<IdentifiedPhoto> photos;
  for (const std::string& image : images) {
    try {
      PhotoFacts facts = ReadPhotoFactsAndSize(image);
      const CameraIdentity identity(facts);
      photos.push_back({image, std::move(facts), identity});
    } catch (const Error& error) {
      Log(LogLevel::kWarning, std::string("skipped: ") + error.what());
    }
  }
  return photos;
}

// The first photo of the camera of each photo: those of one camera have the same.
std::vector<std::size_t> FindFirstPhotos(const std::vector<IdentifiedPhoto>& photos) {
  std::vector<std::size_t> first(photos.size());
  std::vector<std::size_t> cameras;  // first photos of the known ones
  for (std::size_t i = 0; i < photos.size(); ++i) {
    if (!photos[i].identity.IsKnown()) continue;
    const auto camera = std::ranges::find_if(cameras, [&](std::size_t j) {
      return photos[j].HasSizeOf(photos[i]) && photos[j].identity.IsSame(photos[i].identity);
    });
    first[i] = camera == cameras.end() ? i : *camera;
    if (first[i] == i) cameras.push_back(i);
  }
  // Of the only known camera of their size, or of one of their own.
  std::vector<std::size_t> unknown_cameras;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    if (photos[i].identity.IsKnown()) continue;
    const auto has_size = [&](std::size_t j) { return photos[j].HasSizeOf(photos[i]); };
    if (std::ranges::count_if(cameras, has_size) == 1) {
      first[i] = *std::ranges::find_if(cameras, has_size);
      continue;
    }
    const auto camera = std::ranges::find_if(unknown_cameras, has_size);
    first[i] = camera == unknown_cameras.end() ? i : *camera;
    if (first[i] == i) unknown_cameras.push_back(i);
  }
  return first;
}

CameraGroup GroupOfCamera(const IdentifiedPhoto& first) {
  const CameraIdentity& identity = first.identity;
  return {DefaultCameraPrior(first.facts.width, first.facts.height),
          identity.make,
          identity.model,
          identity.serial,
          identity.lens,
          identity.focal_mm,
          {}};
}

// Mirrored ones, which no camera makes, count as not turned.
int TurnOfPhoto(const std::string& photo) {
  const ImageMetadata metadata = ReadImageMetadata(photo);
  if (metadata.exif.empty()) return 0;
  switch (ParseExif(metadata.exif).orientation) {
    case 3:
      return 180;
    case 6:
      return 90;
    case 8:
      return 270;
    default:
      return 0;
  }
}

// Of the first, and a few between it and the last.
int TurnOfPhotos(const std::vector<std::string>& photos) {
  constexpr std::size_t kMostRead = 10;
  const std::size_t stride = std::max<std::size_t>(1, photos.size() / kMostRead);
  std::optional<int> turn_deg;
  for (std::size_t i = 0; i < photos.size(); i += stride) {
    const int of_photo = TurnOfPhoto(photos[i]);
    if (turn_deg.value_or(of_photo) != of_photo) return 0;
    turn_deg = of_photo;
  }
  return turn_deg.value_or(0);
}

}  // namespace

int ReadShownTurn(const std::string& input) {
  switch (KindOfInput(input)) {
    case InputKind::kImages:
      return TurnOfPhotos(ListImages(input));
    case InputKind::kImage:
      return TurnOfPhoto(input);
    case InputKind::kVideo:
      break;
  }
  return ReadVideoTurn(input);
}

CameraPrior ReadPhotoPrior(const std::filesystem::path& photo) {
  const PhotoFacts facts = ReadPhotoFactsAndSize(photo);
  const std::optional<CameraPrior> prior = PriorFromFacts(facts);
  return prior ? *prior : DefaultCameraPrior(facts.width, facts.height);
}

CameraPrior ReadCameraPrior(const std::string& input) {
  switch (KindOfInput(input)) {
    case InputKind::kImages:
      return PriorOfImages(input, ListImages(input));
    case InputKind::kImage:
      return ReadPhotoPrior(input);
    case InputKind::kVideo:
      break;
  }
  return ReadVideoPrior(input);
}

std::vector<CameraGroup> GroupByCamera(const std::vector<std::string>& images) {
  const std::vector<IdentifiedPhoto> photos = IdentifyPhotos(images);
  const std::vector<std::size_t> first = FindFirstPhotos(photos);
  std::vector<CameraGroup> groups;
  std::vector<std::size_t> num_tries;  // of each group
  std::map<std::size_t, std::size_t> group_of_first;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const auto [entry, is_new] = group_of_first.emplace(first[i], groups.size());
    if (is_new) {
      groups.push_back(GroupOfCamera(photos[first[i]]));
      num_tries.push_back(0);
    }
    CameraGroup& group = groups[entry->second];
    group.images.push_back(photos[i].image);
    const bool has_prior = group.prior.source != CameraPriorSource::kDefault;
    if (has_prior || !photos[i].facts.HasMetadata()) continue;
    if (++num_tries[entry->second] > kMaxTries) continue;
    if (const std::optional<CameraPrior> prior = PriorFromFacts(photos[i].facts)) {
      group.prior = *prior;
    }
  }
  return groups;
}

}  // namespace mono3d
