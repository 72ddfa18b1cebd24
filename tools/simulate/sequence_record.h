// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/core/options.h"
#include "synthetic/control_points.h"
#include "synthetic/flight_statistics.h"
#include "synthetic/gps.h"
#include "synthetic/sequence.h"
#include "synthetic/video_options.h"

namespace mono3d::tools {

// How the files of a sequence are written.
struct SequenceFileOptions {
  int jpeg_quality = 0;             // 1 to 100; 0: PNG
  std::string depth_form = "auto";  // see ChooseDepthForm
  bool uncalibrated = false;        // the pictures once more, in a folder without camera.yaml
  synthetic::VideoOptions video;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// What sequence.json says: all options and, once the sequence is complete, what is in it. Nothing
// that differs from one run to the next.
using SequenceRecord = nlohmann::ordered_json;

// Of a sequence that begins.
SequenceRecord OpenRecord(const std::vector<OptionField>& options);

// The record of a sequence of the same options that was begun in the folder before; nothing in a
// folder without one. Throws Error when another sequence or other images are there.
std::optional<SequenceRecord> FindRecord(const std::filesystem::path& folder,
                                         const SequenceRecord& opened);

bool IsComplete(const SequenceRecord& record);
void WriteRecord(const std::filesystem::path& folder, const SequenceRecord& record);

SequenceRecord ToJson(const synthetic::FlightStatistics& statistics);
// The true camera: lens and shutter.
SequenceRecord ToJson(const CameraModel& camera, const synthetic::SensorOptions& sensor);

// Heights, speeds and rates of the flight of a complete sequence, from its files.
synthetic::FlightSamples ReadSamples(const std::filesystem::path& folder,
                                     const SequenceRecord& record);

// gcp.txt: longitude and latitude on WGS 84, so that no program has to project them.
std::string ControlPointsText(const std::vector<synthetic::TrueControlPoint>& points,
                              const synthetic::GpsOptions& options,
                              const std::function<std::string(int)>& image_of_frame);

// The text of gps.txt: "timestamp east north up", and above it origin and noise as comments.
std::string GpsText(const std::vector<synthetic::GpsFix>& track,
                    const synthetic::GpsOptions& options);
// The text of timestamps.txt: one time a line, seconds.
std::string TimestampsText(const std::vector<double>& timestamps_s);

}  // namespace mono3d::tools
