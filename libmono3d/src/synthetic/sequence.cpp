// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/sequence.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"

namespace mono3d::synthetic {
namespace {

constexpr double kFocalPerWidth = 0.9;
constexpr double kFisheyeFocalPerWidth = 0.4;

Flight FlightOver(const Scene& scene, const FlightOptions& options) {
  return Flight(options, [&scene](const Eigen::Vector2d& p_m) {
    return static_cast<double>(GroundHeight(scene, p_m.cast<float>()));
  });
}

// The `count` values in the middle.
std::vector<double> Middle(const std::vector<double>& values, int count) {
  const auto wanted = static_cast<std::size_t>(count);
  if (count == 0 || values.size() <= wanted) return values;
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>((values.size() - wanted) / 2);
  return {begin, begin + static_cast<std::ptrdiff_t>(wanted)};
}

// Depths and heights that a sparse lattice of rays meets.
struct SparseView {
  std::vector<double> depths_m;
  std::vector<double> heights_m;

  void Add(const Scene& scene, const CameraModel& camera, const Pose& T_world_cam) {
    constexpr int kLattice = 24;  // rays along each side
    const Eigen::Vector3f origin = T_world_cam.translation().cast<float>();
    for (int j = 0; j < kLattice; ++j) {
      for (int i = 0; i < kLattice; ++i) {
        const Eigen::Vector2d pixel((i + 0.5) * camera.width / kLattice - 0.5,
                                    (j + 0.5) * camera.height / kLattice - 0.5);
        const Eigen::Vector3d direction = T_world_cam.rotation() * camera.Unproject(pixel);
        const std::optional<Hit> hit = scene.Intersect({origin, direction.cast<float>()});
        if (!hit || hit->is_moving) continue;
        depths_m.push_back(hit->distance);
        heights_m.push_back(hit->p.z());
      }
    }
  }
};

}  // namespace

CameraModel SequenceCameraOptions::Model() const {
  const bool is_fisheye = lens == ToString(LensModel::kFisheye);
  const double usual = (is_fisheye ? kFisheyeFocalPerWidth : kFocalPerWidth) * width;
  const double focal = focal_px > 0 ? focal_px : usual;
  CameraModel camera = {.width = width,
                        .height = height,
                        .fx = focal,
                        .fy = focal,
                        .cx = 0.5 * (width - 1) + offset_x_px,
                        .cy = 0.5 * (height - 1) + offset_y_px,
                        .distortion = {k1, k2, p1, p2, k3}};
  if (is_fisheye) {
    camera.lens = LensModel::kFisheye;
    camera.distortion = {k1, k2, k3, k4, 0};
  }
  return camera;
}

void SequenceCameraOptions::Visit(OptionVisitor& visit) {
  visit("width", width, "of the images, px");
  visit("height", height, "of the images, px");
  visit("lens", lens, "pinhole, or fisheye: pixels off the middle grow with the angle");
  visit("focal_px", focal_px,
        "focal length; 0: nine tenths of the width, of a fisheye lens four tenths");
  visit("offset_x_px", offset_x_px, "of the principal point to the right of the middle");
  visit("offset_y_px", offset_y_px, "of the principal point below the middle");
  visit("k1", k1, "radial distortion");
  visit("k2", k2, "radial distortion");
  visit("p1", p1, "tangential distortion");
  visit("p2", p2, "tangential distortion");
  visit("k3", k3, "radial distortion");
  visit("k4", k4, "radial distortion of a fisheye lens");
}

void SequenceCameraOptions::Validate() const {
  constexpr int kMax = 16384;
  RequireOption(width >= 16 && width <= kMax, "camera.width", "16 to 16384", width);
  RequireOption(height >= 16 && height <= kMax, "camera.height", "16 to 16384", height);
  RequireOption(std::isfinite(focal_px) && focal_px >= 0, "camera.focal_px", "at least 0",
                focal_px);
  RequireOption(std::abs(offset_x_px) < 0.5 * width, "camera.offset_x_px",
                "less than half of the width", offset_x_px);
  RequireOption(std::abs(offset_y_px) < 0.5 * height, "camera.offset_y_px",
                "less than half of the height", offset_y_px);
  for (const double coefficient : {k1, k2, p1, p2, k3, k4}) {
    RequireOption(std::isfinite(coefficient), "camera.k1, k2, p1, p2, k3 or k4", "a finite number",
                  coefficient);
  }
  const bool is_fisheye = lens == ToString(LensModel::kFisheye);
  if (!is_fisheye && lens != ToString(LensModel::kBrown)) {
    throw UsageError(ErrorParts{.what = "unknown lens",
                                .where = "--camera.lens",
                                .expected = "pinhole or fisheye",
                                .found = lens});
  }
  RequireOption(is_fisheye || k4 == 0, "camera.k4", "0 without a fisheye lens", k4);
  RequireOption(!is_fisheye || (p1 == 0 && p2 == 0), "camera.p1 and p2", "0 with a fisheye lens",
                p1 != 0 ? p1 : p2);
}

void SequenceOptions::Visit(OptionVisitor& visit) {
  visit("fps", frames_per_s, "frame rate");
  visit("fps_sigma", frames_sigma_per_s, "standard deviation of the frame rate");
  visit("max_frames", max_frames, "so many images from the middle of the flight; 0: all");
  visit("depth_stride", depth_stride, "true depth for every so many-th image");
  visit("cloud_voxel", cloud_voxel, "spacing of the true cloud, as a share of the mean depth");
  visit("cloud_max_depth_m", cloud_max_depth_m, "the true cloud ends there, metres");
  visit("seed", seed, "of everything random; one sequence for each");
  visit.Group("scene", scene);
  visit.Group("flight", flight);
  visit.Group("camera", camera);
  visit("render.samples_per_side", render.samples_per_side, "samples a pixel, squared");
  visit.Group("sensor", render.sensor);
  visit.Group("gps", gps);
}

void SequenceOptions::Validate() const {
  RequireOption(frames_per_s >= 0.01 && frames_per_s <= 1000, "fps", "0.01 to 1000", frames_per_s);
  RequireOption(frames_sigma_per_s >= 0 && frames_sigma_per_s <= frames_per_s, "fps-sigma",
                "0 to the frame rate", frames_sigma_per_s);
  RequireOption(max_frames >= 0, "max-frames", "at least 0", max_frames);
  RequireOption(depth_stride >= 1, "depth-stride", "at least 1", depth_stride);
  RequireOption(cloud_voxel >= 1e-5 && cloud_voxel <= 1, "cloud-voxel", "0.00001 to 1",
                cloud_voxel);
  RequireOption(cloud_max_depth_m > 0, "cloud-max-depth-m", "above 0", cloud_max_depth_m);
  scene.Validate();
  flight.Validate();
  camera.Validate();
  render.Validate();
  gps.Validate();
}

void SetSeeds(SequenceOptions& options, int seed) {
  options.seed = seed;
  options.scene.seed = seed;
  options.flight.unsteadiness.seed = seed;
  options.render.sensor.seed = seed;
}

FrameTrack TrackFrames(const SequenceOptions& options, const Flight& flight) {
  const FrameClockOptions clock{.frames_per_s = options.frames_per_s,
                                .sigma_per_s = options.frames_sigma_per_s,
                                .seed = options.seed};
  FrameTrack track;
  for (const double t_s : Middle(FrameTimes(flight.duration_s(), clock), options.max_frames)) {
    // Whole microseconds: the same number in every file, however it is printed.
    track.timestamps_s.push_back(std::round(t_s * 1e6) / 1e6);
    track.T_world_cam.push_back(flight.PoseAt(track.timestamps_s.back()));
  }
  return track;
}

FrameTrack PlanFrames(const SequenceOptions& options) {
  options.Validate();
  return TrackFrames(options, Flight(options.flight));
}

Sequence::Sequence(const SequenceOptions& options)
    : options_((options.Validate(), options)),
      camera_(options.camera.Model()),
      depth_camera_(DepthCamera(camera_)),
      scene_(BuildScene(options.scene)),
      flight_(FlightOver(scene_, options.flight)),
      track_(TrackFrames(options, flight_)) {
  Validate(camera_, "--camera");
}

SequenceSurvey Sequence::Survey() const {
  SparseView view;
  for (int frame = 0; frame < num_frames(); frame += options_.depth_stride) {
    view.Add(scene_, depth_camera_, track_.T_world_cam[static_cast<std::size_t>(frame)]);
  }
  if (view.depths_m.empty()) throw Error("the camera sees nothing but sky on the whole flight");
  SequenceSurvey survey;
  const auto [nearest, farthest] = std::minmax_element(view.depths_m.begin(), view.depths_m.end());
  survey.nearest_m = *nearest;
  survey.farthest_m = *farthest;
  survey.mean_depth_m = Summarise(view.depths_m).mean;
  survey.ground_z_m = Quantile(std::move(view.heights_m), 0.05);
  return survey;
}

Rendering Sequence::RenderFrame(int frame) {
  RenderOptions render = options_.render;
  render.with_depth = HasDepth(frame);
  const double t_s = track_.timestamps_s.at(static_cast<std::size_t>(frame));
  const TimeSpan open = ShutterSpan(render.sensor, t_s);
  scene_.SetTimeSpan(open.begin_s, open.end_s);
  const Shot shot{
      .motion = [this](double at_s) { return flight_.PoseAt(at_s); }, .t_s = t_s, .frame = frame};
  return Render(scene_, camera_, shot, render);
}

std::vector<TrueControlPoint> Sequence::ControlPoints(int count) const {
  FilmedFlight filmed;
  filmed.camera = camera_;
  filmed.camera.shutter = ShutterOf(options_.render.sensor);
  filmed.num_frames = num_frames();
  filmed.T_world_cam_at = [this](int frame, double late_s) {
    return flight_.PoseAt(track_.timestamps_s.at(static_cast<std::size_t>(frame)) + late_s);
  };
  return ControlPointsOf(scene_, filmed, count);
}

const Scene& Sequence::SceneAt(int frame) {
  const double t_s = track_.timestamps_s.at(static_cast<std::size_t>(frame));
  scene_.SetTimeSpan(t_s, t_s);
  return scene_;
}

}  // namespace mono3d::synthetic
