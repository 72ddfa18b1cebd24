// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/position_bench.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <set>
#include <utility>

#include "bench/process.h"
#include "common/json_file.h"
#include "common/tool.h"
#include "evaluate/depth_part.h"
#include "evaluate/files.h"
#include "mono3d/core/error.h"
#include "mono3d/evaluation/cloud_evaluation.h"
#include "mono3d/geo/georeference.h"
#include "mono3d/geo/position_file.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "mono3d/pipeline/georeferencing.h"
#include "mono3d/pipeline/pipeline.h"

namespace mono3d::tools {
namespace {

namespace fs = std::filesystem;

// As the chain has it of level axes.
constexpr double kTilt_rad = 4 * std::numbers::pi / 180;
// Where the axes of the sequences are said to be; any place would do.
constexpr Geodetic kOrigin = {49.01, 8.41, 115};

class NoBundles : public KeyframeSelector {
 public:
  std::optional<ImageBundle> Add(const Keyframe& /*keyframe*/,
                                 const KeyframePoses& /*poses*/) override {
    return std::nullopt;
  }
};

class NoDepth : public DepthEstimator {
 public:
  DepthResult Estimate(const ImageBundle& /*bundle*/) override {
    DepthResult result;
    result.reason = "there is to be none";
    return result;
  }
};

struct TrueFlight {
  std::string name;
  fs::path folder;
  std::string kind;
  std::vector<Frame> frames;
  std::vector<StampedPose> truth;  // of the frames, by time
};

TrueFlight ReadFlight(const std::string& sequence) {
  TrueFlight flight;
  flight.name = NameOfFolder(sequence);
  flight.folder = fs::absolute(sequence);
  if (const fs::path record = flight.folder / "sequence.json"; fs::exists(record)) {
    flight.kind =
        ReadJsonFile<Json>(record).value("/options/flight.kind"_json_pointer, std::string());
  }
  const auto source =
      OpenFrameSource(sequence, ReadCameraFile((flight.folder / "camera.yaml").string()));
  while (std::optional<Frame> frame = source->Next()) flight.frames.push_back(*std::move(frame));
  flight.truth = ReadTrajectory(flight.folder / "groundtruth.txt");
  std::ranges::sort(flight.truth, {}, &StampedPose::timestamp_s);
  if (flight.truth.size() < 3) {
    throw Error(ErrorParts{.what = "too few true poses",
                           .where = flight.folder / "groundtruth.txt",
                           .expected = "3 or more",
                           .found = std::to_string(flight.truth.size())});
  }
  return flight;
}

// The largest map of a whole run but for its depth; nothing where no image was tracked.
std::optional<MapReconstruction> Reconstruct(const TrueFlight& flight,
                                             const TrackerOptions& tracking,
                                             const std::optional<PipelinePositions>& positions) {
  PipelineOptions options;
  options.tracking = tracking;
  options.positions = positions;
  PipelineStages stages;
  stages.tracker = CreateTracker(tracking);
  stages.keyframe_selector = std::make_unique<NoBundles>();
  stages.depth_estimator = std::make_unique<NoDepth>();
  stages.create_surfel_map = []() -> std::unique_ptr<SurfelMap> {
    throw Error("a depth map where there is to be none");
  };
  Pipeline pipeline(std::move(stages), {}, options);
  for (const Frame& frame : flight.frames) pipeline.Process(frame);
  Reconstruction result = pipeline.Finish();
  if (result.maps.empty()) return std::nullopt;
  return std::move(result.maps.front());
}

// Places of a georeference in the axes of the truth.
std::vector<StampedPose> InAxesOfTruth(std::vector<StampedPose> poses, const Geodetic& origin) {
  for (StampedPose& pose : poses) {
    const Geodetic place = ToGeodetic(pose.T_world_cam.translation(), origin);
    pose.T_world_cam = Pose(pose.T_world_cam.rotation(), ToEnu(place, kOrigin));
  }
  return poses;
}

PlacedRun JudgePlacement(const std::vector<StampedPose>& placed, const Georeference& georeference,
                         const TrueFlight& flight, const DrawnPositions& drawn, double stretch_m) {
  PlacedRun run;
  run.path = ComparePlacedPath(InAxesOfTruth(placed, georeference.origin), flight.truth, stretch_m);
  run.error.head<3>() = run.path.middle_m;
  run.error[5] = run.path.heading_rad;
  run.error[6] = run.path.log_scale;
  run.error[7] = georeference.clock_offset_s - drawn.clock_offset_s;
  run.sigma = georeference.covariance.diagonal().cwiseSqrt();
  return run;
}

PlacedRun PlaceMap(MapReconstruction map, const PipelinePositions& positions,
                   const TrueFlight& flight, const DrawnPositions& drawn, double stretch_m) {
  PlaceOnEarth(positions, map);
  if (!map.georeference) return {map.why_no_georeference, {}, {}, {}};
  std::vector<StampedPose> placed;
  for (const TrajectoryEntry& frame : map.trajectory) {
    placed.push_back({frame.timestamp_s, frame.T_world_cam});
  }
  return JudgePlacement(placed, *map.georeference, flight, drawn, stretch_m);
}

PlacedRun PlaceTruth(const TrueFlight& flight, const DrawnPositions& drawn, double stretch_m) {
  std::vector<PositionedCamera> cameras;
  for (const StampedPose& pose : flight.truth) {
    cameras.push_back({pose.timestamp_s, {}, pose.T_world_cam});
  }
  const GeoreferenceResult result =
      EstimateGeoreference(cameras, drawn.track, UpDirection{Eigen::Vector3d::UnitZ(), kTilt_rad});
  if (!result.georeference) return {result.reason, {}, {}, {}};
  std::vector<StampedPose> placed = flight.truth;
  for (StampedPose& pose : placed) {
    pose.T_world_cam = result.georeference->S_enu_map * pose.T_world_cam;
  }
  return JudgePlacement(placed, *result.georeference, flight, drawn, stretch_m);
}

double GroundSample(const TrueFlight& flight) {
  const auto depth = FindMeanDepth(FindSequenceFiles(flight.folder).depth, {});
  if (!depth) throw Error("no true depth maps to tell the ground sample distance");
  return depth->metres / flight.frames.front().camera.fx;
}

PlacedModel MakeModel(const TrueFlight& flight, const DrawnPositions& drawn,
                      const fs::path& positions, const fs::path& output) {
  const std::vector<std::string> command = {(ProgramFolder() / "mono3d-reconstruct").string(),
                                            flight.folder.string(),
                                            "--camera",
                                            (flight.folder / "camera.yaml").string(),
                                            "--camera-fixed",
                                            "--positions",
                                            positions.string(),
                                            "-o",
                                            output.string()};
  const ProcessResult process = RunProcess(command, output.string() + ".log", 0, StopRequested());
  if (process.exit_status != 0) return {"mono3d-reconstruct: " + process.ending};
  PointCloud model = ReadPly(output / "model.ply");
  const std::optional<Geodetic> origin = OriginOf(drawn.track);
  for (Eigen::Vector3f& point : model.points) {
    point = ToEnu(ToGeodetic(point.cast<double>(), *origin), kOrigin).cast<float>();
  }
  const PointCloud truth = ReadPly(flight.folder / "cloud.ply");
  const CloudEvaluation evaluation = EvaluateCloud(model, truth, Similarity(), {});
  PlacedModel placed;
  placed.ground_sample_m = GroundSample(flight);
  placed.median_m = evaluation.error_at_start.estimate_to_truth_plane.median;
  placed.rmse_m = evaluation.error_at_start.estimate_to_truth_plane.rmse;
  placed.median_aligned_m = evaluation.error.estimate_to_truth_plane.median;
  return placed;
}

class FlightBench {
 public:
  FlightBench(const PositionBenchOptions& options, const std::string& sequence)
      : options_(options), flight_(ReadFlight(sequence)) {
    alone_ = Reconstruct(flight_, options.tracking, std::nullopt);
  }

  PositionRun Run(const ReceiverKind& kind, const std::string& kind_name, int draw) {
    PositionRun run;
    run.sequence = flight_.name;
    run.flight = flight_.kind;
    run.receiver = kind.name;
    run.seed = options_.seed + draw;
    // Each sequence and kind with errors of its own.
    const std::string of = flight_.name + "/" + kind_name + "/" + std::to_string(run.seed);
    const DrawnPositions drawn =
        DrawPositions(flight_.truth, kOrigin, kind, options_.draw, HashOf(of));
    const fs::path file = fs::path(options_.output) / (flight_.name + "_" + kind_name + "_" +
                                                       std::to_string(run.seed) + ".csv");
    WritePositionTable(file, drawn.track);
    const PositionTrack track = ReadPositionFile(file);
    AddBound(kind, drawn, run);
    const PipelinePositions positions{track, {}, 0, {}};
    run.true_path = PlaceTruth(flight_, drawn, options_.stretch_m);
    if (!alone_) {
      run.followed.reason = run.rigid.reason = "no image was tracked";
      return run;
    }
    run.rigid = PlaceMap(*alone_, positions, flight_, drawn, options_.stretch_m);
    std::optional<MapReconstruction> map = Reconstruct(flight_, options_.tracking, positions);
    if (!map) {
      run.followed.reason = "no image was tracked";
      return run;
    }
    run.share_tracked =
        static_cast<double>(map->trajectory.size()) / static_cast<double>(flight_.frames.size());
    run.followed = PlaceMap(*std::move(map), positions, flight_, drawn, options_.stretch_m);
    if (options_.with_models && kind.is_stated && draw == 0) {
      fs::path output = file;
      run.model = MakeModel(flight_, drawn, file, output.replace_extension());
    }
    return run;
  }

 private:
  // FNV-1a.
  static std::uint64_t HashOf(const std::string& text) {
    std::uint64_t hash = 14695981039346656037U;
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
    return hash;
  }

  void AddBound(const ReceiverKind& kind, const DrawnPositions& drawn, PositionRun& run) const {
    // Of an even distribution.
    const double offset_s = options_.draw.max_clock_offset_s / std::sqrt(3.0);
    const PlacementBound bound(flight_.truth, drawn, kind.noise, {kTilt_rad, offset_s});
    run.bound = bound.covariance().diagonal().cwiseSqrt();
    run.error_of_best = bound.error_of_best();
  }

  const PositionBenchOptions& options_;
  TrueFlight flight_;
  std::optional<MapReconstruction> alone_;
};

}  // namespace

std::vector<PositionRun> BenchPositions(const PositionBenchOptions& options,
                                        const std::function<void(const PositionRun&)>& on_run) {
  std::vector<PositionRun> runs;
  for (const std::string& sequence : options.sequences) {
    if (StopRequested()) break;
    FlightBench bench(options, sequence);
    for (const std::string& name : options.kinds) {
      const ReceiverKind kind = ReceiverKindOf(name);
      for (int draw = 0; draw < options.num_draws && !StopRequested(); ++draw) {
        runs.push_back(bench.Run(kind, name, draw));
        on_run(runs.back());
      }
    }
  }
  return runs;
}

}  // namespace mono3d::tools
