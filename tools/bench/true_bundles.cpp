// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/true_bundles.h"

#include <algorithm>
#include <utility>

#include "evaluate/files.h"
#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/depth_image_file.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/trajectory_file.h"
#include "mono3d/keyframes/keyframe_selector.h"

namespace mono3d::tools {
namespace {

using Indices = std::vector<std::size_t>;  // of the images of a bundle

struct Sequence {
  SequenceFiles files;
  CameraModel camera;
  std::vector<StampedPose> poses;
};

Sequence ReadSequence(const std::string& folder) {
  Sequence sequence;
  sequence.files = FindSequenceFiles(folder);
  const auto require = [&](bool holds, const std::string& what, const std::string& expected,
                           const std::string& found) {
    if (!holds) throw Error(ErrorParts{what, folder, expected, found});
  };
  require(!sequence.files.camera.empty(), "no camera.yaml in the sequence", "", "");
  require(!sequence.files.depth.empty(), "no true depth in the sequence", "depth/", "");
  require(!sequence.files.groundtruth.empty(), "no true poses in the sequence", "groundtruth.txt",
          "");
  sequence.camera = ReadCameraFile(sequence.files.camera.string());
  sequence.poses = ReadTrajectory(sequence.files.groundtruth.string());
  require(sequence.poses.size() == sequence.files.images.size(), "wrong number of true poses",
          std::to_string(sequence.files.images.size()) + ", one for each image",
          std::to_string(sequence.poses.size()));
  return sequence;
}

// Nothing where the image has no true depth.
cv::Mat ReadTruth(const Sequence& sequence, std::size_t index) {
  const auto found =
      sequence.files.depth.find(NumberOfImage(sequence.files, static_cast<std::int64_t>(index)));
  return found == sequence.files.depth.end() ? cv::Mat() : ReadDepthImage(found->second);
}

// Those that fit into the sequence, around each image with a true depth.
std::vector<Indices> BundlesByStep(const Sequence& sequence, std::size_t step) {
  std::vector<Indices> bundles;
  const std::size_t reach = kBundleSize / 2 * step;
  for (std::size_t middle = reach; middle + reach < sequence.poses.size(); ++middle) {
    const auto number = NumberOfImage(sequence.files, static_cast<std::int64_t>(middle));
    if (!sequence.files.depth.contains(number)) continue;
    Indices indices;
    for (std::size_t i = 0; i < kBundleSize; ++i) indices.push_back(middle - reach + i * step);
    bundles.push_back(indices);
  }
  return bundles;
}

// Keyframe i is image i.
KeyframePoses PosesOf(const Sequence& sequence) {
  std::vector<KeyframePose> poses;
  for (std::size_t i = 0; i < sequence.poses.size(); ++i) {
    poses.push_back({.keyframe_id = static_cast<std::int64_t>(i),
                     .map_id = 0,
                     .S_world_kf = {1, sequence.poses[i].T_world_cam}});
  }
  return {0, std::move(poses)};
}

std::vector<Indices> BundlesOfSelector(const Sequence& sequence) {
  const KeyframePoses poses = PosesOf(sequence);
  const auto selector = CreateKeyframeSelector();
  std::vector<Indices> bundles;
  for (std::size_t i = 0; i < sequence.poses.size(); ++i) {
    const cv::Mat truth = ReadTruth(sequence, i);
    if (truth.empty()) continue;
    Keyframe keyframe;
    keyframe.id = static_cast<std::int64_t>(i);
    keyframe.frame.camera = sequence.camera;
    keyframe.sparse_depths_su = SparseDepths(truth);
    const std::optional<ImageBundle> bundle = selector->Add(keyframe, poses);
    const bool is_whole = bundle && bundle->keyframes.size() == kBundleSize &&
                          bundle->reference_index() == kBundleSize / 2;
    if (!is_whole) continue;
    Indices indices;
    for (const Keyframe& chosen : bundle->keyframes) {
      indices.push_back(static_cast<std::size_t>(chosen.id));
    }
    bundles.push_back(indices);
  }
  return bundles;
}

TrueBundle ReadTrueBundle(const Sequence& sequence, const Indices& indices) {
  std::vector<std::string> images;
  std::vector<Pose> T_world_cam;
  TrueBundle result;
  for (const std::size_t index : indices) {
    images.push_back(sequence.files.images[index]);
    Keyframe keyframe;
    keyframe.id = static_cast<std::int64_t>(index);
    result.bundle.keyframes.push_back(std::move(keyframe));
    T_world_cam.push_back(sequence.poses[index].T_world_cam);
  }
  SetPoses(T_world_cam, result.bundle);
  const auto source = OpenFrameSource(images, sequence.camera, {});
  for (Keyframe& keyframe : result.bundle.keyframes) keyframe.frame = source->Next().value();
  const std::size_t middle = result.bundle.reference_index();
  result.true_depth = ReadTruth(sequence, indices[middle]);
  result.bundle.keyframes[middle].sparse_depths_su = SparseDepths(result.true_depth);
  return result;
}

}  // namespace

std::vector<float> SparseDepths(const cv::Mat& depth) {
  constexpr int kSpacing_px = 24;
  std::vector<float> depths_su;
  for (int y = 0; y < depth.rows; y += kSpacing_px) {
    for (int x = 0; x < depth.cols; x += kSpacing_px) {
      if (depth.at<float>(y, x) > 0) depths_su.push_back(depth.at<float>(y, x));
    }
  }
  return depths_su;
}

std::vector<TrueBundle> ReadTrueBundles(const std::string& folder, int num_bundles, int step) {
  const Sequence sequence = ReadSequence(folder);
  const std::vector<Indices> all = step > 0
                                       ? BundlesByStep(sequence, static_cast<std::size_t>(step))
                                       : BundlesOfSelector(sequence);
  if (all.empty()) {
    throw Error(ErrorParts{
        .what = "no bundle in the sequence",
        .where = folder,
        .expected = std::to_string(kBundleSize) + " images with true poses around a true depth",
        .found = std::to_string(sequence.poses.size()) + " images"});
  }
  const std::size_t wanted = std::min(all.size(), static_cast<std::size_t>(num_bundles));
  std::vector<TrueBundle> bundles;
  for (std::size_t i = 0; i < wanted; ++i) {
    bundles.push_back(ReadTrueBundle(sequence, all[(2 * i + 1) * all.size() / (2 * wanted)]));
  }
  return bundles;
}

}  // namespace mono3d::tools
