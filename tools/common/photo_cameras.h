// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

#include "common/camera_choice.h"
#include "mono3d/io/camera_metadata.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/pipeline/run_writer.h"

namespace mono3d::tools {

// The cameras of photographs of several, or of one with several zooms.
struct PhotoCameras {
  CamerasOfImages cameras;
  std::vector<CameraOfRun> of_run;  // each, with what the photographs said of it
};

// Are images of several cameras among them, two or more besides those of one? Looks at some dozens,
// spread over the input: they are no video then. False of a video file.
bool AreOfSeveralCameras(const std::string& input);

// The groups of the input's images; of a video none.
std::vector<CameraGroup> GroupsOfInput(const std::string& input);

// What the photographs say of all cameras, in one adjustment, beginning with what their metadata
// say. A calibration that is told is that of the group of its size, of several of these of the one
// whose focal length is nearest. Throws UsageError where there is none.
PhotoCameras ChooseCamerasOfPhotos(const std::string& input, const std::vector<CameraGroup>& groups,
                                   const FrameSourceOptions& source,
                                   const CameraArguments& arguments,
                                   const PhotoMapperOptions& photos,
                                   const PositionsOfMap& positions);

// One line for people: "camera 2 (Canon EOS 5D), 14 photographs of 713x483: focal length ...".
std::string PhotoCameraLine(std::size_t number, const CameraOfRun& camera);

}  // namespace mono3d::tools
