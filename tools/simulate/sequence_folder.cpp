// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/sequence_folder.h"

#include <string>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"
#include "mono3d/image/undistorter.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/image_file.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "simulate/compressed_film.h"
#include "simulate/depth_file.h"
#include "simulate/exif.h"
#include "simulate/exposure_log.h"
#include "simulate/image_file.h"
#include "simulate/uncalibrated_folder.h"
#include "synthetic/true_cloud.h"

namespace mono3d::tools {
namespace {

namespace fs = std::filesystem;

// The seed of the GPS is not that of the frame clock, so that their errors have nothing in common.
constexpr std::uint64_t kGpsSeedOffset = 0x6750'5331;

constexpr const char* kRawFolder = "frames";  // until the video is done

// One sequence and where its files go.
class SequenceWriter {
 public:
  SequenceWriter(const synthetic::SequenceOptions& options, const SequenceFileOptions& file_options,
                 const fs::path& folder)
      : file_options_(file_options),
        folder_(folder),
        sequence_(options),
        survey_(sequence_.Survey()),
        depth_form_(ChooseDepthForm(file_options.depth_form, survey_)),
        gps_(synthetic::GpsTrack(track().timestamps_s, track().T_world_cam, options.gps,
                                 kGpsSeedOffset + static_cast<std::uint64_t>(options.seed))),
        exposures_(folder / "exposures.txt", track().timestamps_s) {}

  const synthetic::Sequence& sequence() const { return sequence_; }

  void WriteSmallFiles() const {
    CreateOutputFolder(folder_ / "images");
    CreateOutputFolder(folder_ / "depth");
    if (is_video()) CreateOutputFolder(RawFolder());
    CameraModel camera = sequence_.camera();
    camera.shutter = synthetic::ShutterOf(sequence_.options().render.sensor);
    WriteCameraFile(folder_ / "camera.yaml", camera);
    if (sequence_.camera().HasDistortion()) {
      WriteCameraFile(folder_ / "depth" / "camera.yaml", sequence_.depth_camera());
    }
    std::vector<StampedPose> truth;
    for (std::size_t i = 0; i < track().timestamps_s.size(); ++i) {
      truth.push_back({track().timestamps_s[i], track().T_world_cam[i]});
    }
    WriteTrajectory(folder_ / "groundtruth.txt", truth);
    WriteFileAtomically(folder_ / "timestamps.txt", TimestampsText(track().timestamps_s));
    WriteFileAtomically(folder_ / "gps.txt", GpsText(gps_, sequence_.options().gps));
    WriteControlPoints();
    WriteDepthScale(folder_ / "depth", depth_form_);
  }

  // Returns whether there was anything to do. The image comes last: where it is, so is its depth.
  bool WriteFrame(int frame) {
    if (fs::exists(RawPath(frame)) && exposures_.Has(frame)) return false;
    const synthetic::Rendering rendering = sequence_.RenderFrame(frame);
    if (sequence_.HasDepth(frame)) {
      WriteDepth(DepthPath(folder_ / "depth", FrameName(frame), depth_form_), rendering.depth,
                 depth_form_);
    }
    exposures_.Add(frame, rendering.exposure);
    WriteFileAtomically(RawPath(frame), EncodeImage(rendering.bgr, frame));
    return true;
  }

  // After the last frame.
  void CompressVideo(SequenceRecord& record) const {
    exposures_.Finish();
    if (!is_video()) return;
    const double fps = sequence_.options().frames_per_s;
    const FilmFiles files = {.num_frames = sequence_.num_frames(),
                             .raw = [this](int frame) { return RawPath(frame); },
                             .decoded = [this](int frame) { return ImagePath(frame); },
                             .video = VideoPath()};
    const FilmQuality quality = CompressFilm(files, fps, file_options_.video);
    record["video"] = {{"frames_per_s", fps},
                       {"start_s", track().timestamps_s.front()},
                       {"bit_rate_mbit_per_s", quality.bit_rate_mbit_per_s},
                       {"psnr_db", quality.psnr_db}};
  }

  // What the options do not ask for, and what they ask for in another form.
  void Sort() const {
    if (is_video()) {
      if (file_options_.video.keep == "video") fs::remove_all(folder_ / "images");
      if (file_options_.video.keep == "images") fs::remove(VideoPath());
    }
    if (file_options_.uncalibrated) LinkUncalibrated(folder_);
  }

  // Returns the number of points and puts the 5 % quantile of their heights into `ground_z_m`.
  std::size_t WriteCloud(double& ground_z_m) {
    synthetic::TrueCloud cloud(VoxelSize(), sequence_.options().cloud_max_depth_m);
    const Undistorter undistorter(sequence_.camera());
    for (int frame = 0; frame < sequence_.num_frames(); ++frame) {
      if (!sequence_.HasDepth(frame)) continue;
      // As it was written, so that a run that goes on finds the same colours.
      const cv::Mat bgr = ReadImage(ImagePath(frame));
      cloud.Add(sequence_.SceneAt(frame), sequence_.depth_camera(),
                track().T_world_cam[static_cast<std::size_t>(frame)], undistorter.Undistort(bgr));
    }
    const PointCloud points = cloud.Build();
    if (points.empty()) throw Error("the true cloud is empty: see --cloud-max-depth-m");
    WritePly(folder_ / "cloud.ply", points);
    std::vector<float> heights;
    for (const Eigen::Vector3f& point : points.points) heights.push_back(point.z());
    ground_z_m = Quantile(std::move(heights), 0.05);
    return points.size();
  }

  void Describe(SequenceRecord& record, double ground_z_m, std::size_t num_points) const {
    record["images"] = sequence_.num_frames();
    record["mean_depth_m"] = survey_.mean_depth_m;
    record["nearest_m"] = survey_.nearest_m;
    record["farthest_m"] = survey_.farthest_m;
    record["ground_z_m"] = ground_z_m;
    record["depth_rounding"] =
        depth_form_.is_pfm ? 0.0 : 0.5 / (depth_form_.png_scale * survey_.nearest_m);
    record["camera"] = ToJson(sequence_.camera(), sequence_.options().render.sensor);
    record["cloud"] = {{"points", num_points}, {"voxel_m", VoxelSize()}};
    record["flight"] = ToJson(synthetic::Summarise(
        synthetic::SampleFlight(track().timestamps_s, track().T_world_cam, ground_z_m)));
  }

 private:
  const synthetic::FrameTrack& track() const { return sequence_.track(); }
  double VoxelSize() const { return sequence_.options().cloud_voxel * survey_.mean_depth_m; }

  void WriteControlPoints() const {
    // Six to be used and two to check by; where the flight has fewer places for them, fewer.
    constexpr int kNumPoints = 8;
    const std::vector<synthetic::TrueControlPoint> points = sequence_.ControlPoints(kNumPoints);
    if (points.empty()) return;
    WriteFileAtomically(folder_ / "gcp.txt",
                        ControlPointsText(points, sequence_.options().gps, [this](int frame) {
                          return ImagePath(frame).filename().string();
                        }));
  }

  bool is_video() const { return file_options_.video.IsOn(); }

  fs::path VideoPath() const { return folder_ / "video.mp4"; }
  fs::path RawFolder() const { return folder_ / kRawFolder; }
  // As rendered: the image itself, or what goes into the video.
  fs::path RawPath(int frame) const {
    return is_video() ? RawFolder() / (FrameName(frame) + ".png") : ImagePath(frame);
  }
  fs::path ImagePath(int frame) const {
    const std::string extension = file_options_.jpeg_quality > 0 ? ".jpg" : ".png";
    return folder_ / "images" / (FrameName(frame) + extension);
  }

  std::string EncodeImage(const cv::Mat& bgr, int frame) const {
    if (file_options_.jpeg_quality == 0) return EncodePng(bgr);
    const synthetic::GpsFix& fix = gps_[static_cast<std::size_t>(frame)];
    return WithExif(EncodeJpeg(bgr, file_options_.jpeg_quality),
                    {.timestamp_s = fix.timestamp_s,
                     .width = bgr.cols,
                     .height = bgr.rows,
                     .focal_px = sequence_.camera().fx,
                     .place = ToGeodetic(fix.p_enu_m, sequence_.options().gps.Origin())});
  }

  SequenceFileOptions file_options_;
  fs::path folder_;
  synthetic::Sequence sequence_;
  synthetic::SequenceSurvey survey_;
  DepthForm depth_form_;
  std::vector<synthetic::GpsFix> gps_;
  ExposureLog exposures_;
};

SequenceRecord RecordOf(synthetic::SequenceOptions options, SequenceFileOptions file_options) {
  std::vector<OptionField> fields = ListOptions(options);
  for (const OptionField& field : ListOptions(file_options)) fields.push_back(field);
  return OpenRecord(fields);
}

}  // namespace

SequenceRun WriteSequence(const synthetic::SequenceOptions& options,
                          const SequenceFileOptions& file_options, const fs::path& folder,
                          const FrameObserver& observer) {
  options.Validate();
  file_options.Validate();
  SequenceRun run{.record = RecordOf(options, file_options)};
  if (const std::optional<SequenceRecord> earlier = FindRecord(folder, run.record)) {
    run.record = *earlier;
    if (IsComplete(run.record)) {
      fs::remove_all(folder / kRawFolder);
      return run;
    }
  }
  SequenceWriter writer(options, file_options, folder);
  CreateOutputFolder(folder);
  WriteRecord(folder, run.record);
  writer.WriteSmallFiles();
  const int num_frames = writer.sequence().num_frames();
  for (int frame = 0; frame < num_frames; ++frame) {
    if (writer.WriteFrame(frame)) ++run.num_rendered;
    if (!observer(frame + 1, num_frames)) return run;
  }
  writer.CompressVideo(run.record);
  double ground_z_m = 0;
  const std::size_t num_points = writer.WriteCloud(ground_z_m);
  run.record["complete"] = true;
  writer.Describe(run.record, ground_z_m, num_points);
  writer.Sort();
  WriteRecord(folder, run.record);
  fs::remove_all(folder / kRawFolder);
  return run;
}

}  // namespace mono3d::tools
