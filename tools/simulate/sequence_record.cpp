// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/sequence_record.h"

#include <iomanip>
#include <sstream>
#include <variant>

#include "common/json_file.h"
#include "mono3d/core/error.h"
#include "mono3d/core/version.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d::tools {
namespace {

SequenceRecord ToJson(const synthetic::Spread& spread) {
  return {{"mean", spread.mean}, {"sigma", spread.sigma}, {"min", spread.min}, {"max", spread.max}};
}

// The first option that differs, for a message.
std::string Difference(const SequenceRecord& there, const SequenceRecord& wanted) {
  for (const auto& [name, value] : wanted.items()) {
    if (!there.contains(name)) return "no --" + name;
    if (there[name] != value) return "--" + name + " " + there[name].dump();
  }
  return "other options";
}

SequenceRecord Parse(const std::filesystem::path& path) {
  auto record = ReadJsonFile<SequenceRecord>(path);
  if (record.is_object() && record.contains("options") && record.contains("complete")) {
    return record;
  }
  throw Error(ErrorParts{.what = "not the record of a simulated sequence",
                         .where = path,
                         .expected = "JSON with options and complete",
                         .found = record.is_discarded() ? "no JSON" : "other fields"});
}

}  // namespace

void SequenceFileOptions::Visit(OptionVisitor& visit) {
  visit("jpeg_quality", jpeg_quality, "write JPEG with EXIF, 1 to 100; 0: PNG without");
  visit("depth_form", depth_form,
        "png: 16 bits, pfm: 32 bits, auto: png where it rounds by at most 0.01 %");
  visit("uncalibrated", uncalibrated,
        "write uncalibrated/ as well: the same pictures and times without a camera.yaml");
  visit.Group("video", video);
}

void SequenceFileOptions::Validate() const {
  RequireOption(jpeg_quality >= 0 && jpeg_quality <= 100, "jpeg-quality", "0 to 100", jpeg_quality);
  video.Validate();
  RequireOption(jpeg_quality == 0 || !video.IsOn(), "jpeg-quality", "0 with --video.codec",
                jpeg_quality);
  if (depth_form == "auto" || depth_form == "png" || depth_form == "pfm") return;
  throw UsageError(ErrorParts{.what = "unknown form of depth",
                              .where = "--depth-form",
                              .expected = "auto, png or pfm",
                              .found = depth_form});
}

SequenceRecord OpenRecord(const std::vector<OptionField>& options) {
  SequenceRecord record;
  record["mono3d"] = Version();
  record["complete"] = false;
  for (const OptionField& field : options) {
    std::visit([&](const auto* value) { record["options"][field.name] = *value; }, field.value);
  }
  return record;
}

std::optional<SequenceRecord> FindRecord(const std::filesystem::path& folder,
                                         const SequenceRecord& opened) {
  const std::filesystem::path path = folder / "sequence.json";
  if (!std::filesystem::exists(path)) {
    const std::filesystem::path images = folder / "images";
    if (!std::filesystem::is_directory(images) || std::filesystem::is_empty(images)) return {};
    throw Error(ErrorParts{.what = "the folder holds images of another origin",
                           .where = images,
                           .expected = "an empty or a new folder",
                           .found = "no sequence.json beside images"});
  }
  SequenceRecord record = Parse(path);
  if (record["options"] == opened["options"] && record["mono3d"] == opened["mono3d"]) {
    return record;
  }
  throw Error(
      ErrorParts{.what = "another sequence was begun in this folder",
                 .where = path,
                 .expected = "the options of now and mono3d " + opened["mono3d"].get<std::string>(),
                 .found = record["options"] == opened["options"]
                              ? "mono3d " + record["mono3d"].dump()
                              : Difference(record["options"], opened["options"])});
}

bool IsComplete(const SequenceRecord& record) { return record["complete"] == true; }

void WriteRecord(const std::filesystem::path& folder, const SequenceRecord& record) {
  WriteFileAtomically(folder / "sequence.json", JsonText(record));
}

SequenceRecord ToJson(const synthetic::FlightStatistics& statistics) {
  return {{"height_m", ToJson(statistics.height_m)},
          {"angular_velocity_rad_per_s", ToJson(statistics.angular_velocity_rad_per_s)},
          {"speed_m_per_s", ToJson(statistics.speed_m_per_s)},
          {"frames_per_s", ToJson(statistics.frames_per_s)}};
}

SequenceRecord ToJson(const CameraModel& camera, const synthetic::SensorOptions& sensor) {
  return {{"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"lens", ToString(camera.lens)},
          {"distortion", camera.distortion},
          {"readout_s", sensor.readout_s},
          {"readout_direction", sensor.readout_direction},
          {"line_delay_s", synthetic::LineDelay_s(sensor, camera.width, camera.height)},
          {"exposure_s", sensor.exposure_s}};
}

synthetic::FlightSamples ReadSamples(const std::filesystem::path& folder,
                                     const SequenceRecord& record) {
  std::vector<double> timestamps_s;
  std::vector<Pose> poses;
  for (const StampedPose& pose : ReadTrajectory(folder / "groundtruth.txt")) {
    timestamps_s.push_back(pose.timestamp_s);
    poses.push_back(pose.T_world_cam);
  }
  return synthetic::SampleFlight(timestamps_s, poses, record.at("ground_z_m").get<double>());
}

std::string GpsText(const std::vector<synthetic::GpsFix>& track,
                    const synthetic::GpsOptions& options) {
  std::ostringstream text;
  text << "# timestamp east north up: seconds and metres from the origin\n"
       << std::setprecision(12) << "# origin (WGS 84 latitude_deg longitude_deg altitude_m) "
       << options.latitude_deg << ' ' << options.longitude_deg << ' ' << options.altitude_m
       << "\n# standard deviation of the error: " << options.horizontal_m << " m east and north, "
       << options.vertical_m << " m up, correlated over " << options.correlation_s << " s\n";
  text << std::fixed;
  for (const synthetic::GpsFix& fix : track) {
    text << std::setprecision(6) << fix.timestamp_s << std::setprecision(4) << ' '
         << fix.p_enu_m.x() << ' ' << fix.p_enu_m.y() << ' ' << fix.p_enu_m.z() << '\n';
  }
  return text.str();
}

std::string ControlPointsText(const std::vector<synthetic::TrueControlPoint>& points,
                              const synthetic::GpsOptions& options,
                              const std::function<std::string(int)>& image_of_frame) {
  std::ostringstream text;
  text << "EPSG:4326\n# longitude latitude altitude pixel_x pixel_y image name: true places, and "
          "where the images show them\n"
       << std::fixed;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Geodetic place = ToGeodetic(points[i].p_world_m, options.Origin());
    for (const synthetic::TrueMark& mark : points[i].marks) {
      // A tenth of a millimetre, a thousandth of a pixel.
      text << std::setprecision(9) << place.longitude_deg << ' ' << place.latitude_deg << ' '
           << std::setprecision(4) << place.altitude_m << ' ' << std::setprecision(3)
           << mark.pixel.x() << ' ' << mark.pixel.y() << ' ' << image_of_frame(mark.frame) << " gcp"
           << i + 1 << '\n';
    }
  }
  return text.str();
}

std::string TimestampsText(const std::vector<double>& timestamps_s) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(6);
  for (const double t_s : timestamps_s) text << t_s << '\n';
  return text.str();
}

}  // namespace mono3d::tools
