// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/uncalibrated_folder.h"

#include <system_error>

#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {
namespace {

namespace fs = std::filesystem;

void LinkOrCopy(const fs::path& from, const fs::path& to) {
  if (!fs::exists(from)) return;
  std::error_code error;
  fs::create_hard_link(from, to, error);
  if (error) fs::copy_file(from, to, error);
  if (!error) return;
  throw Error(ErrorParts{.what = "cannot write the file: " + error.message(),
                         .where = to,
                         .expected = {},
                         .found = {},
                         .code = ErrorCode::kIo});
}

}  // namespace

void LinkUncalibrated(const fs::path& sequence_folder) {
  const fs::path folder = sequence_folder / "uncalibrated";
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  CreateOutputFolder(folder);
  LinkOrCopy(sequence_folder / "timestamps.txt", folder / "timestamps.txt");
  LinkOrCopy(sequence_folder / "video.mp4", folder / "video.mp4");
  const fs::path images = sequence_folder / "images";
  if (!fs::is_directory(images)) return;
  CreateOutputFolder(folder / "images");
  for (const fs::directory_entry& image : fs::directory_iterator(images)) {
    LinkOrCopy(image.path(), folder / "images" / image.path().filename());
  }
}

}  // namespace mono3d::tools
