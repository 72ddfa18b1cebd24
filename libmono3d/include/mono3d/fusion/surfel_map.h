// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/core/state_folder.h"
#include "mono3d/core/timing.h"
#include "mono3d/fusion/model_health.h"
#include "mono3d/fusion/registration.h"
#include "mono3d/fusion/surfel_changes.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/gpu/device.h"
#include "mono3d/image/depth_map.h"
#include "mono3d/image/keyframe_constraint.h"
#include "mono3d/image/keyframe_poses.h"

namespace MONO3D_EXPORT mono3d {

enum class FusionStatus { kFused, kRejected };

// Why a depth map is not in the model.
enum class FusionRejection {
  kNoEstimate,     // there is no depth in it
  kOtherMap,       // its keyframe is of another map of the tracker
  kNotRegistered,  // it does not fit the model, or it cannot be told
  kModelFull,
  kOther,  // said in words alone
};

// A depth map that was tried again.
struct RetriedMap {
  std::int64_t frame_index = 0;
  double timestamp_s = 0;
  FusionStatus status = FusionStatus::kRejected;
  bool is_waiting = false;
  RegistrationEvidence registration;
};

// A depth map of the model.
struct FusedDepthMap {
  std::int64_t frame_index = 0;
  double timestamp_s = 0;
  std::int64_t keyframe_id = 0;
  // Where the model has its keyframe, by the latest poses: S_world_kf of the tracker, moved where
  // the model contradicted it. From the unit of the depth map's depths, which is no longer the
  // keyframe's own one where the poses of DepthMap::views have changed.
  Similarity S_world_kf;
};

// Submaps of the model, which hung together by the tracker's poses alone, have become one: a depth
// map showed both, and was registered with each.
struct SubmapJoin {
  std::int64_t frame_index = 0;  // of that depth map
  int num_submaps = 0;           // that became one with the oldest of them
  double moved_px = 0;           // by how much the farthest was off, as motion in the image
  double scale = 1;              // by which its lengths were multiplied
  std::int64_t num_merged = 0;   // surfels that became one with another
};

// What became of one depth map.
struct FusionResult {
  FusionStatus status = FusionStatus::kRejected;
  FusionRejection rejection = FusionRejection::kOther;  // where it is rejected
  std::string reason;       // why it was rejected; the model is then as it was
  bool is_waiting = false;  // rejected for now: it is tried again when the model has changed
  Similarity S_world_kf;    // where it was fused, as of a FusedDepthMap
  RegistrationEvidence registration;
  std::int64_t num_merged = 0;    // pixels that confirmed a surfel
  std::int64_t num_inserted = 0;  // pixels that became a new surfel
  std::int64_t num_removed = 0;   // surfels that stood in free space
  // Pixels of DepthMap::inferred that became or confirmed a surfel.
  std::int64_t num_inferred = 0;
  std::int64_t num_surfels = 0;  // in the model afterwards
  // What became of depth maps that had waited, and whether the latest part of the model was taken
  // out and made again from its depth maps before that.
  std::vector<RetriedMap> retried;
  bool is_repaired = false;
  // How its image was exposed: grey value = gain * the model's + offset. 1 and 0 where it was not
  // fused or has no image.
  double exposure_gain = 1;
  double exposure_offset = 0;
  bool starts_submap = false;  // it shows nothing of the model: it lies where the tracker has it
  std::vector<SubmapJoin> submap_joins;  // by it, and by those that were tried again
  // Of this depth map, and of those that were tried again, where the model contradicted the
  // tracker: for Tracker::Constrain.
  std::vector<KeyframeConstraint> constraints;
  ModelHealth health;  // afterwards
};

// What became of the model when its keyframes were moved.
struct UpdateResult {
  bool has_moved = false;  // a keyframe of the model is elsewhere, by a tenth of a pixel or more
  std::int64_t num_merged = 0;   // surfels that became one with another, of a part they fell upon
  std::int64_t num_surfels = 0;  // in the model afterwards
};

// Which surfels belong to the exported model.
struct SurfelExportOptions {
  int min_observations = 1;  // depth maps that agree on a surfel
  // 1/7: one undisputed observation of confidence 1/6 (an expected error of half a percent of the
  // depth) is enough. More than 0 leaves out as well what more speaks against than for (if hidden,
  // only where one depth map alone saw it) and what has fewer than 8 others within three radii.
  double min_confidence = 1.0 / 7;
  // Enough where nothing of min_confidence is within one and a half radii. 1/22: one undisputed
  // observation with an expected error of two percent of the depth, as of crowns of trees. Of what
  // is farther away than the median surfel (by its radius) less, so that the error is no larger.
  // What was matched on a coarser level alone (kCoarselyMatched) is never more than that. 1: such
  // places stay empty.
  double gap_confidence = 1.0 / 22;
  // Of what was matched, the surest, whatever their confidence: a few images of a camera that
  // hardly moved show a scene too, if to some percent of the depth.
  double min_share = 0.25;
  // More than 0: surfels in one cell of a grid become one; edge of a cell in radii of the median
  // surfel.
  double voxel_radii = 0;
  // What no depth map matched on any level, but depth maps inferred from the surface around.
  bool with_inferred = true;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// The coloured surfel model of the scene (paper, section 3.3). Its colours are those of the
// exposure of its first depth map's image: later images are brought to it by what they show of the
// model. A falloff towards the corners of the images is learned on the way and taken out of them.
class SurfelMap {
 public:
  virtual ~SurfelMap() = default;

  // Throws Error on an invalid depth map, one of a camera with distortion, and one whose keyframe
  // is not in `poses`, the tracker's of this moment, which the model follows as in Update.
  // Rejected, with the model as it was: a depth map without an estimate in it, one of another map
  // of the tracker than the first, and one whose registration with the model is not to be trusted.
  // Where the model has all the surfels that it may have, or the device no room for those that the
  // map shows, the model becomes coarser, with a warning in the log, up to eight times; beyond that
  // the map is rejected.
  [[nodiscard]] virtual FusionResult Integrate(const DepthMap& map, const KeyframePoses& poses) = 0;

  // The tracker has its keyframes elsewhere: their surfels follow, and parts that come to lie upon
  // each other are merged, at the latest with the next depth map that shows them. Keyframes that
  // `poses` does not know follow their neighbours.
  virtual UpdateResult Update(const KeyframePoses& poses) = 0;

  // Takes over the model of another map of the tracker that has become one with this one's by
  // `poses`, and leaves it empty; what both show is merged. Nothing is returned, and nothing has
  // changed, where `other` is of another kind or there is no room.
  virtual std::optional<UpdateResult> Join(SurfelMap& other, const KeyframePoses& poses);

  // The depth maps in the model, in the order of their frames.
  virtual std::vector<FusedDepthMap> DepthMaps() const = 0;

  // For a viewer: the surfels that have changed since the version it has, 0 at first. Costs what
  // has changed, not what there is.
  virtual SurfelChanges ChangesSince(std::uint64_t version);

  // No depth map will come for a while: lets go of the memory that is not the model itself. What
  // waited to be tried again is given up.
  virtual void Rest() {}

  // Puts everything on which the results of later calls depend into the save that `folder` is
  // making, as parts whose names begin with `name` and a slash; Commit is the caller's. Between
  // calls of Integrate, by the same thread. Where the folder's last save was this model's, costs
  // what has changed since; its surfels are not looked at else. Throws Error where a part cannot be
  // written, and for a kind of model that cannot be saved (kUnsupported).
  virtual void SaveState(StateFolder& folder, const std::string& name);
  // Of a model that is new, made with the options of the one that was saved: from here on every
  // result is bit for bit that of the saved one, on a device of the same kind. Throws Error where
  // parts are missing, damaged or of another version, where the options are others, and where the
  // model does not fit the device; it must not be used then.
  virtual void RestoreState(const StateFolder& folder, const std::string& name);

  // The surfels in the order in which they were inserted (by depth map, then by rows of pixels),
  // with all fields of PointCloud filled. confidence = s / (s + a + 1): s is the sum of the
  // confidences with which depth maps saw the surfel (1 each where a depth map has none), a the sum
  // of those with which depth maps saw through it, and of those, 1 at most, that saw a surface
  // before it. One sure observation gives 0.5, nine undisputed ones 0.9. Behind them, in the same
  // order, the inferred ones, marked, where something is inferred (PointCloud::inferred).
  virtual PointCloud Export(const SurfelExportOptions& options) const = 0;

  // The same, as the last call but that of the destructor: the memory of the model is let go before
  // that of the work on its surfels is taken.
  virtual PointCloud ExportLast(const SurfelExportOptions& options) { return Export(options); }

  // Whatever their confidence.
  PointCloud Export(int min_observations) const {
    return Export(SurfelExportOptions{.min_observations = min_observations, .min_confidence = 0});
  }

  virtual std::int64_t num_surfels() const = 0;  // that were matched
};

// When a pixel of a depth map and a surfel are the same surface.
struct AssociationOptions {
  double matching_error_px = 0.5;    // one sigma of the matching behind the depth maps
  double max_sigmas = 3;             // depth difference, in sigmas of pixel and surfel together
  double max_normal_angle_deg = 60;  // three sigmas of two normals that scatter by 15 degrees each

  void Visit(OptionVisitor& visit);
};

// When a depth map proves that there is nothing where a surfel stands.
struct FreeSpaceOptions {
  double min_sigmas = 4;  // surfel in front of the measured surface, in sigmas of both together

  void Visit(OptionVisitor& visit);
};

// Depth maps that do not fit the model are kept and tried again when others were fused.
struct RetryOptions {
  int max_waiting = 8;   // at once; of more the oldest is given up
  int max_attempts = 3;  // of each
  int num_recent = 16;   // depth maps of the model that are kept to make its latest part again

  void Visit(OptionVisitor& visit);
};

// Where the surfels are. What they are does not depend on it. Those that views of late have not
// seen leave the device for the memory of the host, and where that is not enough for a file; they
// come back when a view sees them. Half of what may be on the device is for what was matched, half
// for what was not, or on a coarser level alone.
struct SurfelStorageOptions {
  // What one view sees is on the device, however much that is, with a warning. 0: a quarter of its
  // memory. Each field of the surfels is one buffer, which a device may not have as large as that.
  int max_device_mb = 0;
  int max_host_mb = 0;  // of those that are not on the device; 0: an eighth of the memory
  std::string folder;   // of the file, which has no name; empty: that of temporary files

  void Visit(OptionVisitor& visit);
};

struct SurfelMapOptions {
  AssociationOptions association;
  FreeSpaceOptions free_space;
  RegistrationOptions registration;
  RegistrationGateOptions gate;
  RetryOptions retry;
  HealthOptions health;
  SurfelStorageOptions storage;
  // Off: every estimate of a depth map counts alike, whatever confidence the map gives it.
  bool with_confidence = true;
  // So many past depth maps review the surfels that a new one adds.
  int num_reviews = 8;
  // 48 bytes each, in memory or in a file. Beyond it the model becomes coarser.
  int max_surfels = 200'000'000;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// `times`, where given, must outlive the map.
std::unique_ptr<SurfelMap> CreateSurfelMap(std::shared_ptr<Device> device,
                                           const SurfelMapOptions& options = {},
                                           StageTimes* times = nullptr);

}  // namespace mono3d
