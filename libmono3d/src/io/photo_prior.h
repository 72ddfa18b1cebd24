// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "io/dji_xmp.h"
#include "io/exif_camera.h"
#include "mono3d/geometry/camera_prior.h"

namespace mono3d {

// What a photo's file says of the camera.
struct PhotoFacts {
  std::string name;  // for messages
  int width = 0;     // px, as stored; 0: only decoding the file tells it
  int height = 0;
  std::optional<ExifCamera> exif;
  std::optional<DjiXmp> xmp;
  bool has_damaged_xmp = false;

  bool HasMetadata() const { return exif || xmp || has_damaged_xmp; }
  std::string Serial() const;
};

// Throws Error when the file cannot be read.
PhotoFacts ReadPhotoFacts(const std::filesystem::path& photo);

// The prior from `facts`; their width and height must be known. Nothing when neither XMP nor EXIF
// tell a usable focal length. Warns of what is passed over.
std::optional<CameraPrior> PriorFromFacts(const PhotoFacts& facts);

// The focal length over the larger side of an image of `width` x `height`, and its relative
// standard deviation, from the focal length in 35 mm film. `focal_mm` is that of the lens, 0 where
// it is not told.
struct RelativeFocal {
  double value = 0;
  double sigma = 0;
};
RelativeFocal FocalOf35mm(double focal_35mm, double focal_mm, int width, int height);

// The prior of a picture of `width` x `height` that was made of the one that `original` is of: by
// resizing, cropping or turning it by 90 degrees, as the sizes tell.
CameraPrior TransferToPicture(const CameraPrior& original, int width, int height);

}  // namespace mono3d
