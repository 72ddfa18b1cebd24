// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_prior.h"

namespace MONO3D_EXPORT mono3d {

// The prior of the camera that took a photo, from what the file says of it, first that is usable:
// - XMP of DJI: DewarpData (focal lengths, principal point and distortion as the maker measured
//   them), then CalibratedFocalLength and CalibratedOpticalCenterX/Y (as designed, in pixels);
// - EXIF: FocalLength with FocalPlaneXResolution, FocalPlaneYResolution and
//   FocalPlaneResolutionUnit, then FocalLengthIn35mmFilm;
// - the default of its size.
// JPEG files are read up to their pixels, TIFF files whole; other forms have no metadata that is
// read. The prior is of the pixels as they are stored, which is how FrameSource reads them: the
// orientation tag changes nothing. A picture that was resized, cropped or turned after it was taken
// is told by PixelXDimension and PixelYDimension, which such programs leave alone or correct.
// Metadata that is damaged or absurd is passed over with a warning in the log. Throws Error when
// the file is no image that can be read.
CameraPrior ReadPhotoPrior(const std::filesystem::path& photo);

// The prior of the camera of an image sequence. `input` is what OpenFrameSource takes: of a folder,
// a glob or an image it is that of the first photo with metadata of the camera; of a video it is
// made of `focal_len` in the telemetry beside it (DJI_0001.SRT beside DJI_0001.MP4), as OpenCV
// hands on nothing that a container says of the camera. Otherwise it is the default of the images'
// size. Throws Error when there is nothing to read.
CameraPrior ReadCameraPrior(const std::string& input);

// By how many degrees programs that show the images of the input turn them clockwise, as the
// container of a video or EXIF says: 0, 90, 180 or 270; 0 where photos differ. FrameSource does not
// turn them. Throws Error when there is nothing to read.
int ReadShownTurn(const std::string& input);

// The photos that one camera took with one zoom.
struct CameraGroup {
  CameraPrior prior;
  std::string make;            // of the camera, as EXIF tells it; empty: not told
  std::string model;           // the same
  std::string serial;          // the same, or XMP's
  std::string lens;            // its model; empty: not told, or not to be changed
  double focal_length_mm = 0;  // of the first photo; 0: not told
  std::vector<std::string> images;
};

// Photos of one image size, make, model, serial number, lens and focal length (within 1 %) are of
// one group, in the order of their first photos. How the camera was held does not matter: pixels
// are read as the sensor has them, whatever the orientation tag says, so that photos held upright
// and lengthwise have one calibration. Photos that a program turned have another size. Photos
// without metadata belong to the only group of their size, or make one. Files that cannot be read
// are left out with a warning in the log. Takes O(images * groups).
std::vector<CameraGroup> GroupByCamera(const std::vector<std::string>& images);

}  // namespace mono3d
