// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "mono3d/io/any_trajectory_file.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d::fuzz {

void Trajectory(std::string_view input) {
  static const InputFolder folder("trajectory");
  const auto file = folder.Write("trajectory.txt", input);
  static_cast<void>(ReadOrRefuse([&] { return ReadTrajectory(file); }));
  const auto poses = ReadOrRefuse([&] { return ReadAnyTrajectory(file); });
  if (!poses) return;
  const auto written = folder.path() / "written.txt";
  WriteTrajectory(written, *poses);
  static_cast<void>(ReadTrajectory(written));
}

}  // namespace mono3d::fuzz
