// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/core/export.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geo/georeference.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/keyframe_poses.h"
#include "mono3d/image/sparse_model.h"

namespace MONO3D_EXPORT mono3d {

// What happened so far.
struct PipelineCounts {
  std::int64_t num_frames = 0;
  std::int64_t num_dropped_frames = 0;           // besides: pushed, but waited for too long
  std::int64_t num_tracked = 0;                  // when they came
  std::int64_t num_recovered = 0;                // later: before a start, during a loss, or a photo
  std::int64_t num_keyframes = 0;                // finalised ones
  std::int64_t num_keyframes_without_image = 0;  // they came to nothing; see Tracker
  std::int64_t num_bundles = 0;
  std::int64_t num_dropped_bundles = 0;  // of them, live: the depth stage was busy
  std::int64_t num_depth_maps = 0;
  std::int64_t num_fused = 0;
  std::int64_t num_fused_late = 0;       // of them, at a later attempt
  std::int64_t num_repairs = 0;          // times that the latest part of a model was made again
  std::int64_t num_submaps_started = 0;  // depth maps that showed nothing of the model so far
  std::int64_t num_submaps_joined = 0;   // that a depth map showed to be part of an older one
  std::int64_t num_models_joined = 0;    // of two maps of the tracker that became one
  std::int64_t num_corrections = 0;      // times that the model was moved with the tracker's map
  // Depth maps of which the tracker was told that the model has them elsewhere; some twice, of two
  // submaps.
  std::int64_t num_constraints = 0;
  std::string selector_findings;  // KeyframeSelector::Findings
  // Depth maps with less work than the options say, live, so that no bundle was dropped: how many,
  // by DepthEffort.
  std::map<std::string, std::int64_t> reduced_depth_maps;
  // How often, by reason.
  std::map<std::string, std::int64_t> untracked_frames;  // when they came
  std::map<std::string, std::int64_t> rejected_bundles;
  std::map<std::string, std::int64_t> rejected_depth_maps;
};

// What became of one depth map, or of a later attempt with it.
struct FusionRecord {
  std::int64_t frame_index = 0;
  FusionStatus status = FusionStatus::kRejected;
  FusionRejection rejection = FusionRejection::kOther;  // where it was rejected
  std::string reason;                                   // why it was rejected
  bool is_retry = false;                                // it had been tried before
  RegistrationEvidence registration;
  bool starts_submap = false;  // it showed nothing of the model so far
  bool is_repaired = false;    // after it the latest part of the model was made again
};

// From this depth map on the model was in another state.
struct HealthChange {
  std::int64_t frame_index = 0;
  HealthState state = HealthState::kGood;
  std::string reason;
};

// Where the axes of a map come from.
enum class AxesSource {
  kFirstCamera,  // they are the tracker's own: those of the first camera
  kLevel,        // z is up: ChooseWorldAxes
  kSavedMap,     // those of the run that saved the map
  kEarth,        // x east, y north, z up, metres: PlaceOnEarth
};
const char* ToString(AxesSource source);  // "first camera", "level", "saved map", "earth"

struct WorldAxes {
  Similarity S_axes_world;  // from the tracker's own axes
  AxesSource source = AxesSource::kFirstCamera;
};

// What the chain knows of one map of the tracker; maps have no common frame or scale.
struct MapReconstruction {
  int map_id = 0;
  std::vector<TrajectoryEntry> trajectory;         // every tracked frame, final
  std::vector<TrajectoryEntry> online_trajectory;  // as known when tracked, in order of time
  std::vector<TrajectoryEntry> keyframes;
  std::vector<TrajectoryEntry> model_trajectory;  // fused depth maps
  PointCloud model;
  SparseModel sparse;                        // the tracker's keyframes and points
  std::vector<FusionRecord> fusions;         // in the order in which they were tried
  ModelHealth health;                        // at the end
  std::vector<HealthChange> health_changes;  // good at first
  std::vector<SubmapJoin> submap_joins;
  WorldAxes axes = {};                            // that all of this is in: see MoveInto
  std::optional<PositionFit> position_fit = {};   // where it has followed positions
  std::optional<Georeference> georeference = {};  // where the axes are those of the earth
  std::string why_no_georeference = {};           // where there are positions, but they are not
};

// How a live run kept up with frames that came at their own pace.
struct LiveStatistics {
  std::int64_t num_dropped_frames = 0;
  double frames_per_s = 0;  // that were tracked
  // From when a frame was pushed until its pose was known: mean, exceeded by one in twenty,
  // largest.
  double mean_latency_ms = 0, p95_latency_ms = 0, max_latency_ms = 0;
};

// How a live run that began with a camera prior came to its camera (SelfCalibratingPipeline).
struct SelfCalibration {
  CameraModel camera;  // of the images as taken, that the result is made with
  int num_attempts = 0;
  std::optional<CameraCalibration> calibration;  // of the latest attempt
  // The first frame that was pushed after the learned camera had been adopted; nothing where it
  // was not.
  std::optional<std::int64_t> adopted_at_frame;
  std::string reason;  // why it was not
};

struct Reconstruction {
  std::vector<MapReconstruction> maps;  // the one with most tracked frames first
  PipelineCounts counts;
  // Photographs without a place in any map, by the index of their frame: why.
  std::map<std::int64_t, std::string> unplaced_photos = {};
  std::optional<LiveStatistics> live;  // after Start
  std::optional<SelfCalibration> self_calibration;
};

}  // namespace mono3d
