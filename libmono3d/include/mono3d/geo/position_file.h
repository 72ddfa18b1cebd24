// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geo/position_track.h"

namespace MONO3D_EXPORT mono3d {

// Reads positions, in whichever of these forms the file has (its content decides):
// - telemetry of DJI beside a video (.SRT): "[latitude: 41.42] [longitude: 2.16] [rel_alt: 1.2
//   abs_alt: 30]", "GPS(149.0251,-20.2533,16)", "F/2.8, SS 30.15, ..., GPS (-121.7, 48.0, 17), H
//   200.70m, G.PRY (...)". Behind GPS stand longitude, latitude and the number of satellites; where
//   the last one has the unit M, latitude, longitude and altitude;
// - the same in the subtitles of an MP4 or QuickTime video (.MP4, .MOV);
// - GPX (track points, else route points, else waypoints) with ele, time;
// - NMEA 0183: GGA, with the date and speed of RMC and the errors of GST; checksums are compared;
// - CSV with named columns (comma, semicolon or tab): latitude, longitude, and where there are any
//   altitude, height, time, the image's file name (its times are then those of the images),
//   standard deviations;
// - geo.txt of OpenDroneMap in EPSG:4326: image longitude latitude [altitude ...];
// - gps.txt: "time latitude longitude altitude [height]", or, below a comment "# origin (...)
//   latitude longitude altitude", "time east north up" in metres from there.
//
// Times that do not ascend are put in order; of entries that repeat one place, as telemetry does
// that is written faster than the receiver measures, the first one of each second is kept. Entries
// that are cut off or make no sense are counted and passed over. Throws Error when the file cannot
// be read, has none of these forms, or no position at all; the message says which line stands in
// the way.
PositionTrack ReadPositionFile(const std::filesystem::path& path);

// The positions in the EXIF and XMP data of photos, by file name: latitude, longitude and altitude,
// height above take-off and gimbal angles (DJI), standard deviations (DJI's RtkStdLat, RtkStdLon,
// RtkStdHgt; EXIF's GPSHPositioningError). Times (DateTimeOriginal with its fraction and its offset
// from UTC) where all photos with a position tell theirs; in UTC where all tell the offset as well,
// otherwise as the camera's clock showed them. Empty where no photo has any. Files that cannot be
// read are passed over.
PositionTrack ReadPhotoPositions(const std::vector<std::string>& images);

// The telemetry beside a video: DJI_0001.SRT beside DJI_0001.MP4, whatever the case of its ending;
// also .gpx, .nmea, .csv. Nothing where there is none.
std::optional<std::filesystem::path> FindPositionFile(const std::filesystem::path& video);

// The positions that come with an input of OpenFrameSource: those in its photographs, of the file
// beside the video, or in its subtitles. Nothing where there are none. Throws Error where that file
// is damaged.
std::optional<PositionTrack> ReadPositionsOf(const std::string& input);

}  // namespace mono3d
