// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/run_json.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <numbers>
#include <utility>

#include "mono3d/core/version.h"
#include "pipeline/json_value.h"

namespace mono3d {
namespace {

const char* ToString(RunEnd end) {
  switch (end) {
    case RunEnd::kFinished:
      return "finished";
    case RunEnd::kStopped:
      return "stopped";
    case RunEnd::kFailed:
      return "failed";
    case RunEnd::kUnfinished:
      return "unfinished";
  }
  return "unknown";
}

// The options as one object, by their dotted names.
JsonValue OptionsJson(const std::vector<OptionField>& options) {
  JsonValue json = JsonValue::Object();
  for (const OptionField& field : options) {
    if (const auto word = WordOf(field)) {
      json.Set(field.name, *word);
    } else {
      std::visit([&](const auto* value) { json.Set(field.name, *value); }, field.value);
    }
  }
  return json;
}

JsonValue ReasonsJson(const std::map<std::string, std::int64_t>& reasons) {
  JsonValue json = JsonValue::Object();
  for (const auto& [reason, times] : reasons) json.Set(reason, times);
  return json;
}

JsonValue CountsJson(const PipelineCounts& counts, const RunRecord& record) {
  JsonValue json = JsonValue::Object();
  json.Set("frames", counts.num_frames);
  json.Set("images_skipped", record.num_skipped_images);
  if (record.num_passed_over_images) {
    json.Set("images_passed_over", *record.num_passed_over_images);
  }
  json.Set("tracked", counts.num_tracked);
  json.Set("recovered", counts.num_recovered);
  json.Set("keyframes", counts.num_keyframes);
  json.Set("keyframes_without_image", counts.num_keyframes_without_image);
  json.Set("bundles", counts.num_bundles);
  json.Set("bundles_dropped", counts.num_dropped_bundles);
  json.Set("depth_maps", counts.num_depth_maps);
  if (!counts.reduced_depth_maps.empty()) {
    json.Set("reduced_depth_maps", ReasonsJson(counts.reduced_depth_maps));
  }
  json.Set("fused", counts.num_fused);
  json.Set("fused_late", counts.num_fused_late);
  json.Set("repairs", counts.num_repairs);
  json.Set("submaps_started", counts.num_submaps_started);
  json.Set("submaps_joined", counts.num_submaps_joined);
  json.Set("models_joined", counts.num_models_joined);
  json.Set("corrections", counts.num_corrections);
  json.Set("constraints", counts.num_constraints);
  if (!counts.selector_findings.empty()) json.Set("views_for_depth", counts.selector_findings);
  json.Set("untracked_frames", ReasonsJson(counts.untracked_frames));
  json.Set("rejected_bundles", ReasonsJson(counts.rejected_bundles));
  json.Set("rejected_depth_maps", ReasonsJson(counts.rejected_depth_maps));
  return json;
}

// Over the points, of each one's mean: what COLMAP calls the mean reprojection error.
double MeanReprojection_px(const SparseModel& model) {
  const std::vector<double> errors_px = ReprojectionErrors_px(model);
  double sum = 0;
  for (const double error_px : errors_px) sum += error_px;
  return errors_px.empty() ? 0 : sum / static_cast<double>(errors_px.size());
}

JsonValue HealthJson(const ModelHealth& health) {
  JsonValue json = JsonValue::Object();
  json.Set("state", ToString(health.state));
  json.Set("registrations", health.num_registrations);
  json.Set("accepted_share", health.accepted_share);
  json.Set("moved_share", health.moved_share);
  json.Set("depth_residual_sigmas", health.depth_residual);
  json.Set("scale_drift", health.scale_drift);
  json.Set("deviation_px", health.deviation_px);
  json.Set("submaps", health.num_submaps);
  if (!health.reason.empty()) json.Set("reason", health.reason);
  return json;
}

JsonValue HealthChangesJson(const std::vector<HealthChange>& changes) {
  JsonValue list = JsonValue::List();
  for (const HealthChange& change : changes) {
    JsonValue json = JsonValue::Object();
    json.Set("frame", change.frame_index);
    json.Set("state", ToString(change.state));
    if (!change.reason.empty()) json.Set("reason", change.reason);
    list.Append(std::move(json));
  }
  return list;
}

JsonValue SubmapJoinsJson(const std::vector<SubmapJoin>& joins) {
  JsonValue list = JsonValue::List();
  for (const SubmapJoin& join : joins) {
    JsonValue json = JsonValue::Object();
    json.Set("frame", join.frame_index);
    json.Set("submaps", join.num_submaps);
    json.Set("moved_px", join.moved_px);
    json.Set("scale", join.scale);
    json.Set("merged", join.num_merged);
    list.Append(std::move(json));
  }
  return list;
}

void SetEvidence(const RegistrationEvidence& evidence, JsonValue& json) {
  json.Set("registered", evidence.registered);
  if (!evidence.registered) return;
  json.Set("moved", evidence.moved);
  json.Set("noise", evidence.noise);
  json.Set("overlap", evidence.overlap);
  json.Set("agreement", evidence.agreement);
  json.Set("contradiction", evidence.contradiction);
  json.Set("depth_residual_sigmas", evidence.depth_residual);
  json.Set("grey_residual_sigmas", evidence.grey_residual);
  json.Set("tracker_misfit_sigmas", evidence.tracker_misfit);
  json.Set("deviation_px", evidence.deviation_px);
  json.Set("scale_deviation", evidence.scale_deviation);
  json.Set("uncertainty_px", evidence.uncertainty_px);
}

// p_axes = scale * R(rotation) * p_tracker + translation.
JsonValue AxesJson(const WorldAxes& axes) {
  const Eigen::Quaterniond& q = axes.S_axes_world.pose().rotation();
  const Eigen::Vector3d& t = axes.S_axes_world.pose().translation();
  JsonValue json = JsonValue::Object();
  json.Set("of", ToString(axes.source));
  json.Set("scale", axes.S_axes_world.scale());
  JsonValue rotation = JsonValue::Object();
  rotation.Set("x", q.x());
  rotation.Set("y", q.y());
  rotation.Set("z", q.z());
  rotation.Set("w", q.w());
  json.Set("rotation", std::move(rotation));
  JsonValue translation = JsonValue::Object();
  translation.Set("x", t.x());
  translation.Set("y", t.y());
  translation.Set("z", t.z());
  json.Set("translation", std::move(translation));
  return json;
}

JsonValue NoiseJson(const PositionNoise& noise) {
  JsonValue json = JsonValue::Object();
  json.Set("wander_m", noise.wander_m);
  json.Set("correlation_s", noise.correlation_s);
  json.Set("white_m", noise.white_m);
  return json;
}

JsonValue EnuJson(const Eigen::Vector3d& enu) {
  JsonValue json = JsonValue::Object();
  json.Set("east", enu.x());
  json.Set("north", enu.y());
  json.Set("up", enu.z());
  return json;
}

// "2016-06-23T16:32:06.25" of seconds since 1970; in whichever zone these are.
std::string IsoTime(double unix_s) {
  const auto hundredths = static_cast<std::int64_t>(std::llround(100 * unix_s));
  const std::chrono::sys_time<std::chrono::duration<std::int64_t, std::centi>> time(
      std::chrono::duration<std::int64_t, std::centi>{hundredths});
  const auto day = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss of_day(time - day);
  std::array<char, 64> text{};
  std::snprintf(
      text.data(), text.size(), "%04d-%02u-%02uT%02d:%02d:%02d.%02d", static_cast<int>(date.year()),
      static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
      static_cast<int>(of_day.hours().count()), static_cast<int>(of_day.minutes().count()),
      static_cast<int>(of_day.seconds().count()), static_cast<int>(of_day.subseconds().count()));
  return text.data();
}

JsonValue PositionResidualsJson(const std::vector<PositionResidual>& residuals) {
  JsonValue list = JsonValue::List();
  for (const PositionResidual& residual : residuals) {
    JsonValue json = EnuJson(residual.enu_m);
    json.Set("fix", residual.fix);
    json.Set("time_s", residual.time_s);
    if (!residual.image.empty()) json.Set("image", residual.image);
    if (residual.taken_s) json.Set("taken", IsoTime(*residual.taken_s));
    if (residual.is_outlier) json.Set("outlier", true);
    list.Append(std::move(json));
  }
  return list;
}

// What each ground control point differs by from the survey, and what became of it.
JsonValue ControlJson(const std::vector<ControlResidual>& residuals) {
  JsonValue list = JsonValue::List();
  for (const ControlResidual& residual : residuals) {
    JsonValue json = JsonValue::Object();
    json.Set("name", residual.name);
    json.Set("check", residual.is_check);
    json.Set("used", residual.is_used);
    if (!residual.why_unused.empty()) json.Set("reason", residual.why_unused);
    json.Set("marks", residual.num_marks);
    json.Set("marks_used", residual.num_marks_used);
    if (residual.is_seen) {
      JsonValue off = JsonValue::Object();
      off.Set("east", residual.enu_m.x());
      off.Set("north", residual.enu_m.y());
      if (residual.has_height) off.Set("up", residual.enu_m.z());
      json.Set("residual_m", std::move(off));
      json.Set("residual_px", residual.rms_px);
    }
    if (!residual.contradicting_images.empty()) {
      JsonValue images = JsonValue::List();
      for (const std::string& image : residual.contradicting_images) {
        JsonValue one = JsonValue::Object();
        one.Set("image", image);
        images.Append(std::move(one));
      }
      json.Set("contradicting_marks", std::move(images));
    }
    list.Append(std::move(json));
  }
  return list;
}

// Metres; x east, y north, z up of the origin.
JsonValue GeoreferenceJson(const Georeference& georeference) {
  constexpr double kDegree = std::numbers::pi / 180;
  JsonValue origin = JsonValue::Object();
  origin.Set("latitude_deg", georeference.origin.latitude_deg);
  origin.Set("longitude_deg", georeference.origin.longitude_deg);
  origin.Set("altitude_m", georeference.origin.altitude_m);
  JsonValue json = JsonValue::Object();
  json.Set("origin", std::move(origin));
  json.Set("altitude_known", georeference.has_altitude);
  json.Set("scale_sigma", georeference.scale_sigma);
  json.Set("heading_sigma_deg", georeference.heading_sigma_rad / kDegree);
  json.Set("tilt_sigma_deg", georeference.tilt_sigma_rad / kDegree);
  json.Set("position_sigma_m", EnuJson(georeference.position_sigma_m));
  json.Set("clock_offset_s", georeference.clock_offset_s);
  json.Set("clock_offset_sigma_s", georeference.clock_offset_sigma_s);
  json.Set("noise_horizontal", NoiseJson(georeference.horizontal));
  json.Set("noise_vertical", NoiseJson(georeference.vertical));
  json.Set("fixes", georeference.residuals.size());
  json.Set("fixes_used", georeference.num_used);
  json.Set("rms_horizontal_m", georeference.rms_horizontal_m);
  json.Set("rms_vertical_m", georeference.rms_vertical_m);
  json.Set("residuals_m", PositionResidualsJson(georeference.residuals));
  if (!georeference.control.empty()) {
    json.Set("by_ground_control", georeference.is_by_control);
    if (!georeference.why_no_control.empty()) {
      json.Set("ground_control_unused", georeference.why_no_control);
    }
    json.Set("ground_control", ControlJson(georeference.control));
  }
  return json;
}

// How the map has followed positions.
JsonValue PositionFitJson(const PositionFit& fit) {
  constexpr double kDegree = std::numbers::pi / 180;
  JsonValue json = JsonValue::Object();
  json.Set("positions_used", fit.num_used);
  json.Set("outliers", fit.num_outliers);
  json.Set("ground_control_used", fit.num_points_used);
  json.Set("ground_control_outliers", fit.num_point_outliers);
  json.Set("noise_horizontal", NoiseJson(fit.horizontal));
  json.Set("noise_vertical", NoiseJson(fit.vertical));
  json.Set("drift_rotation_deg", fit.drift.rotation_rad / kDegree);
  json.Set("drift_scale", fit.drift.log_scale);
  json.Set("rms_moved_m", fit.rms_moved_m);
  return json;
}

// One line of evidence per attempt.
JsonValue FusionsJson(const std::vector<FusionRecord>& fusions) {
  JsonValue list = JsonValue::List();
  for (const FusionRecord& fusion : fusions) {
    JsonValue json = JsonValue::Object();
    json.Set("frame", fusion.frame_index);
    json.Set("fused", fusion.status == FusionStatus::kFused);
    if (!fusion.reason.empty()) json.Set("reason", fusion.reason);
    if (fusion.is_retry) json.Set("retry", true);
    if (fusion.starts_submap) json.Set("starts_submap", true);
    if (fusion.is_repaired) json.Set("repair", true);
    SetEvidence(fusion.registration, json);
    list.Append(std::move(json));
  }
  return list;
}

// Of the first and the last frame with a depth map in the model.
JsonValue ModelFramesJson(const std::vector<TrajectoryEntry>& model_trajectory) {
  const auto [first, last] =
      std::ranges::minmax_element(model_trajectory, {}, &TrajectoryEntry::frame_index);
  JsonValue json = JsonValue::Object();
  json.Set("first", first->frame_index);
  json.Set("first_s", first->timestamp_s);
  json.Set("last", last->frame_index);
  json.Set("last_s", last->timestamp_s);
  return json;
}

JsonValue MapsJson(const std::vector<MapReconstruction>& maps) {
  JsonValue list = JsonValue::List();
  for (const MapReconstruction& map : maps) {
    JsonValue json = JsonValue::Object();
    json.Set("map", map.map_id);
    json.Set("frames", map.trajectory.size());
    json.Set("keyframes", map.keyframes.size());
    json.Set("depth_maps_fused", map.model_trajectory.size());
    if (!map.model_trajectory.empty()) {
      json.Set("model_frames", ModelFramesJson(map.model_trajectory));
    }
    json.Set("surfels", map.model.size());
    json.Set("surfels_inferred",
             std::ranges::count_if(map.model.inferred,
                                   [](std::uint8_t inferred) { return inferred != 0; }));
    json.Set("sparse_images", map.sparse.images.size());
    json.Set("sparse_points", map.sparse.points.size());
    json.Set("sparse_reprojection_px", MeanReprojection_px(map.sparse));
    json.Set("axes", AxesJson(map.axes));
    if (map.position_fit) json.Set("followed_positions", PositionFitJson(*map.position_fit));
    if (map.georeference) json.Set("georeference", GeoreferenceJson(*map.georeference));
    if (!map.why_no_georeference.empty()) json.Set("no_georeference", map.why_no_georeference);
    json.Set("health", HealthJson(map.health));
    json.Set("health_changes", HealthChangesJson(map.health_changes));
    json.Set("submap_joins", SubmapJoinsJson(map.submap_joins));
    json.Set("fusions", FusionsJson(map.fusions));
    list.Append(std::move(json));
  }
  return list;
}

JsonValue LiveJson(const LiveStatistics& live) {
  JsonValue dropped = JsonValue::Object();
  if (live.num_dropped_frames > 0) {
    dropped.Set("waited past live.max_delay_s or live.max_waiting_mb", live.num_dropped_frames);
  }
  JsonValue latency = JsonValue::Object();
  latency.Set("mean", live.mean_latency_ms);
  latency.Set("p95", live.p95_latency_ms);
  latency.Set("max", live.max_latency_ms);
  JsonValue json = JsonValue::Object();
  json.Set("frames_dropped", std::move(dropped));
  json.Set("frames_per_s", live.frames_per_s);
  json.Set("latency_ms", std::move(latency));
  return json;
}

JsonValue LiveInputJson(const LiveInputReport& report) {
  JsonValue json = JsonValue::Object();
  json.Set("images", report.num_images);
  json.Set("dropped", report.num_dropped);
  json.Set("damaged", report.num_damaged);
  json.Set("timed_by_arrival", report.num_by_arrival);
  json.Set("reconnects", report.num_reconnects);
  json.Set("missed_s", report.missed_s);
  if (!report.end.empty()) json.Set("end", report.end);
  return json;
}

JsonValue DeviceJson(const DeviceInfo& device) {
  JsonValue json = JsonValue::Object();
  json.Set("name", device.name);
  json.Set("type", device.type);
  json.Set("driver", device.driver);
  return json;
}

JsonValue CameraJson(const CameraPrior& prior) {
  const CameraModel& camera = prior.camera;
  JsonValue json = JsonValue::Object();
  const auto set = [&](const char* name, double value, double sigma) {
    JsonValue parameter = JsonValue::Object();
    parameter.Set("value", value);
    parameter.Set("sigma", sigma);
    json.Set(name, std::move(parameter));
  };
  set("fx", camera.fx, camera.fx * prior.focal_sigma);
  set("fy", camera.fy, camera.fy * std::hypot(prior.focal_sigma, prior.aspect_sigma));
  set("cx", camera.cx, prior.principal_point_sigma_px);
  set("cy", camera.cy, prior.principal_point_sigma_px);
  const std::vector<std::string> names = DistortionNames(camera.lens);
  for (std::size_t i = 0; i < names.size(); ++i) {
    set(names[i].c_str(), camera.distortion[i], prior.distortion_sigma[i]);
  }
  set("readout_s", camera.shutter.readout_s, prior.readout_sigma_s);
  json.Set("reads_columns", camera.shutter.reads_columns);
  json.Set("lens", ToString(camera.lens));
  return json;
}

JsonValue CalibrationJson(const CameraCalibration& calibration) {
  JsonValue json = JsonValue::Object();
  json.Set("source", ToString(calibration.posterior.source));
  json.Set("description", calibration.posterior.description);
  json.Set("learned", calibration.is_learned);
  if (!calibration.reason.empty()) json.Set("reason", calibration.reason);
  json.Set("determines_focal_length", calibration.determines_focal_length);
  json.Set("determines_readout", calibration.determines_readout);
  json.Set("contradicts_prior", calibration.contradicts_prior);
  json.Set("prior", CameraJson(calibration.prior));
  json.Set("camera", CameraJson(calibration.posterior));
  json.Set("change_px", calibration.change_px);
  json.Set("uncertainty_px", calibration.uncertainty_px);
  json.Set("sigma_px", calibration.sigma_px);
  json.Set("principal_point_variation_px", calibration.variation.principal_point_px);
  json.Set("focal_variation", calibration.variation.focal_share);
  json.Set("focal_drift", calibration.variation.focal_drift);
  json.Set("rounds", calibration.num_rounds);
  json.Set("images", calibration.num_images);
  json.Set("points", calibration.num_points);
  json.Set("positions", calibration.num_positions);
  return json;
}

JsonValue CamerasJson(const std::vector<CameraOfRun>& cameras) {
  JsonValue json = JsonValue::List();
  for (const CameraOfRun& camera : cameras) {
    JsonValue one = CalibrationJson(camera.calibration);
    one.Set("name", camera.name);
    one.Set("photos", camera.num_photos);
    one.Set("width", camera.calibration.prior.camera.width);
    one.Set("height", camera.calibration.prior.camera.height);
    json.Append(std::move(one));
  }
  return json;
}

// As it is, without what is known of how well.
JsonValue PlainCameraJson(const CameraModel& camera) {
  JsonValue json = JsonValue::Object();
  json.Set("width", camera.width);
  json.Set("height", camera.height);
  json.Set("fx", camera.fx);
  json.Set("fy", camera.fy);
  json.Set("cx", camera.cx);
  json.Set("cy", camera.cy);
  json.Set("lens", ToString(camera.lens));
  const std::vector<std::string> names = DistortionNames(camera.lens);
  for (std::size_t i = 0; i < names.size(); ++i) json.Set(names[i], camera.distortion[i]);
  if (!camera.shutter.IsGlobal()) json.Set("readout_s", camera.shutter.readout_s);
  return json;
}

JsonValue CamerasOfFilesJson(const std::vector<CameraOfFiles>& cameras) {
  JsonValue json = JsonValue::List();
  for (const CameraOfFiles& camera : cameras) {
    JsonValue one = JsonValue::Object();
    one.Set("files", camera.files);
    one.Set("camera", PlainCameraJson(camera.camera));
    json.Append(std::move(one));
  }
  return json;
}

JsonValue SelfCalibrationJson(const SelfCalibration& self_calibration) {
  JsonValue json = JsonValue::Object();
  json.Set("attempts", self_calibration.num_attempts);
  json.Set("adopted", self_calibration.adopted_at_frame.has_value());
  if (self_calibration.adopted_at_frame) {
    json.Set("adopted_at_frame", *self_calibration.adopted_at_frame);
  }
  if (!self_calibration.reason.empty()) json.Set("reason", self_calibration.reason);
  return json;
}

JsonValue TimesJson(const RunRecord& record) {
  JsonValue json = JsonValue::Object();
  json.Set("wall_s", record.wall_s);
  json.Set("cpu_s", record.cpu_s);
  return json;
}

JsonValue StagesJson(const std::vector<StageTime>& stages) {
  JsonValue json = JsonValue::Object();
  for (const StageTime& stage : stages) {
    JsonValue times = JsonValue::Object();
    times.Set("calls", stage.num_calls);
    times.Set("wall_ms", stage.wall_ms);
    times.Set("gpu_ms", stage.gpu_ms);
    times.Set("cpu_ms", stage.cpu_ms);
    json.Set(stage.stage, std::move(times));
  }
  return json;
}

}  // namespace

std::string RunJson(const Reconstruction& reconstruction, const RunRecord& record) {
  JsonValue json = JsonValue::Object();
  json.Set("mono3d", Version());
  json.Set("end", ToString(record.end));
  if (!record.error.empty()) json.Set("error", record.error);
  if (!record.resumed_after.empty()) {
    JsonValue frames = JsonValue::List();
    for (const std::int64_t frame : record.resumed_after) frames.Append(frame);
    json.Set("resumed_after_frames", std::move(frames));
  }
  json.Set("input", record.input);
  json.Set("photos", record.are_photos);
  json.Set("sparse_video", record.is_sparse_video);
  json.Set("camera", record.camera);
  if (record.calibration) json.Set("calibration", CalibrationJson(*record.calibration));
  if (!record.cameras.empty()) json.Set("cameras", CamerasJson(record.cameras));
  if (!record.cameras_of_files.empty()) {
    json.Set("cameras_of_files", CamerasOfFilesJson(record.cameras_of_files));
  }
  json.Set("device", DeviceJson(record.device));
  json.Set("options", OptionsJson(record.options));
  json.Set("counts", CountsJson(reconstruction.counts, record));
  if (reconstruction.live) json.Set("live", LiveJson(*reconstruction.live));
  if (record.live_input) json.Set("live_input", LiveInputJson(*record.live_input));
  if (reconstruction.self_calibration) {
    json.Set("self_calibration", SelfCalibrationJson(*reconstruction.self_calibration));
  }
  json.Set("maps", MapsJson(reconstruction.maps));
  json.Set("times", TimesJson(record));
  json.Set("stages", StagesJson(record.stages));
  json.Set("peak_memory_bytes", PeakMemoryBytes());
  return json.Text() + "\n";
}

}  // namespace mono3d
