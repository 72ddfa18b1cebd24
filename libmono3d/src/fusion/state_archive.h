// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/byte_archive.h"
#include "geometry/geometry_state.h"
#include "mono3d/core/error.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/depth_map.h"

namespace mono3d {

// How the values of the model lie in the bytes of a saved state: each function writes with a
// ByteWriter, and reads the same bit for bit with a ByteReader, which refuses what cannot be.

template <typename Archive>
constexpr bool kIsReader = std::same_as<Archive, ByteReader>;

// What messages call the state of a model.
inline constexpr const char* kSavedModel = "saved surfel model";

template <typename Archive>
void RequireSound(Archive& archive, bool is_sound) {
  if constexpr (kIsReader<Archive>) {
    if (!is_sound) archive.Refuse("contradicts itself");
  }
}

template <typename Archive, typename Matrix>
void ExchangeMatrix(Archive& archive, Matrix& matrix) {
  for (Eigen::Index i = 0; i < matrix.size(); ++i) archive.Number(matrix.data()[i]);
}

template <typename Archive>
void ExchangePose(Archive& archive, Pose& pose) {
  Eigen::Vector4d q = pose.rotation().coeffs();
  Eigen::Vector3d t = pose.translation();
  ExchangeMatrix(archive, q);
  ExchangeMatrix(archive, t);
  if constexpr (kIsReader<Archive>) {
    RequireSound(archive, t.cwiseAbs().maxCoeff() <= kMostOfState);
    try {
      pose = Pose::Exactly(Eigen::Quaterniond(q), t);
    } catch (const Error&) {
      archive.Refuse("a rotation is none");
    }
  }
}

template <typename Archive>
void ExchangeSimilarity(Archive& archive, Similarity& similarity) {
  double scale = similarity.scale();
  Pose pose = similarity.pose();
  archive.Number(scale);
  ExchangePose(archive, pose);
  if constexpr (kIsReader<Archive>) {
    RequireSound(archive, scale >= kLeastScaleOfState && scale <= kMostOfState);
    similarity = Similarity(scale, pose);
  }
}

template <typename Archive>
void ExchangeSimilarities(Archive& archive, std::vector<Similarity>& list) {
  archive.List(list, [&](Similarity& similarity) { ExchangeSimilarity(archive, similarity); });
}

template <typename Archive, typename T, typename Function>
void ExchangeDeque(Archive& archive, std::deque<T>& deque, const Function& exchange) {
  std::vector<T> list(deque.begin(), deque.end());
  archive.List(list, exchange);
  if constexpr (kIsReader<Archive>) deque.assign(list.begin(), list.end());
}

template <typename Archive>
void ExchangeCamera(Archive& archive, CameraModel& camera) {
  archive.Number(camera.width);
  archive.Number(camera.height);
  for (double* number : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) archive.Number(*number);
  for (double& coefficient : camera.distortion) archive.Number(coefficient);
  archive.Number(camera.shutter.readout_s);
  archive.Number(camera.shutter.reads_columns);
  bool is_fisheye = camera.lens == LensModel::kFisheye;
  archive.Number(is_fisheye);
  camera.lens = is_fisheye ? LensModel::kFisheye : LensModel::kBrown;
  if constexpr (kIsReader<Archive>) {
    // Buffers are made of this size.
    constexpr double kMaxPixels = 1 << 28;
    RequireSound(archive, camera.width > 0 && camera.height > 0 && camera.fx > 0 && camera.fy > 0 &&
                              double{1} * camera.width * camera.height <= kMaxPixels);
  }
}

// An image of this type, empty or of the size of the camera.
template <typename Archive>
void ExchangeImage(Archive& archive, cv::Mat& image, int type, const CameraModel& camera) {
  bool is_there = !image.empty();
  archive.Number(is_there);
  if constexpr (kIsReader<Archive>) {
    image.release();
    if (!is_there) return;
    const std::size_t num_bytes = static_cast<std::size_t>(camera.width) *
                                  static_cast<std::size_t>(camera.height) *
                                  static_cast<std::size_t>(CV_ELEM_SIZE(type));
    if (archive.num_left() < num_bytes) archive.Refuse("ends too early");
    image.create(camera.height, camera.width, type);
  } else if (!is_there) {
    return;
  }
  const std::size_t row_bytes = static_cast<std::size_t>(image.cols) * image.elemSize();
  for (int y = 0; y < image.rows; ++y) archive.Bytes(image.ptr(y), row_bytes);
}

// All but its images.
template <typename Archive>
void ExchangeFrameOf(Archive& archive, DepthMap& map) {
  ExchangeCamera(archive, map.camera);
  archive.Number(map.keyframe_id);
  archive.Number(map.frame_index);
  archive.Number(map.timestamp_s);
  archive.Number(map.depth_sigma_per_square_depth);
  archive.List(map.views, [&](MatchedView& view) {
    archive.Number(view.keyframe_id);
    ExchangePose(archive, view.T_ref_cam);
  });
  archive.Number(map.patch_noise);
  RequireSound(archive, map.patch_noise >= 1 && map.patch_noise <= kMostOfState);
  archive.Number(map.uncertain_border_px);
}

}  // namespace mono3d
