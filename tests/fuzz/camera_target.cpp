// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "mono3d/io/camera_file.h"

namespace mono3d::fuzz {

void Camera(std::string_view input) {
  static const InputFolder folder("camera");
  const auto file = folder.Write("camera", input);
  const auto camera = ReadOrRefuse([&] { return ReadCameraFile(file); });
  if (!camera) return;
  const auto written = folder.path() / "written.yaml";
  WriteCameraFile(written, *camera);
  static_cast<void>(ReadCameraFile(written));
}

}  // namespace mono3d::fuzz
