// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <string>

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "io/photo_prior.h"
#include "mono3d/io/camera_metadata.h"

namespace mono3d::fuzz {

void Photo(std::string_view input) {
  static const InputFolder folder("photo");
  const std::string bytes(input);
  static_cast<void>(ParseExif(std::string("Exif\0\0", 6) + bytes));
  static_cast<void>(ParseDjiXmp(bytes));
  const auto file = folder.Write("photo.jpg", input);
  static_cast<void>(ReadOrRefuse([&] { return GroupByCamera({file.string()}); }));
  PhotoFacts facts = ReadPhotoFacts(file);
  if (facts.width <= 0 || facts.height <= 0) facts.width = facts.height = 100;
  const auto prior = ReadOrRefuse([&] { return PriorFromFacts(facts); });
  if (prior && *prior) Validate(**prior, "prior");
}

}  // namespace mono3d::fuzz
