// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/heic_photo.h"

#include <libheif/heif.h>

#include <cstdint>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace mono3d {
namespace {

void Require(const heif_error& error) {
  if (error.code != heif_error_Ok) throw std::runtime_error(error.message);
}

}  // namespace

std::string HeicPhoto(const cv::Mat& bgr, const std::string& tiff) {
  const std::unique_ptr<heif_context, decltype(&heif_context_free)> context(heif_context_alloc(),
                                                                            heif_context_free);
  heif_encoder* encoder = nullptr;
  if (heif_context_get_encoder_for_format(context.get(), heif_compression_HEVC, &encoder).code !=
      heif_error_Ok) {
    return {};
  }
  Require(heif_encoder_set_lossy_quality(encoder, 95));
  heif_image* image = nullptr;
  Require(heif_image_create(bgr.cols, bgr.rows, heif_colorspace_RGB, heif_chroma_interleaved_RGB,
                            &image));
  Require(heif_image_add_plane(image, heif_channel_interleaved, bgr.cols, bgr.rows, 8));
  int stride = 0;
  std::uint8_t* rows = heif_image_get_plane(image, heif_channel_interleaved, &stride);
  cv::Mat rgb(bgr.rows, bgr.cols, CV_8UC3, rows, static_cast<std::size_t>(stride));
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  heif_image_handle* handle = nullptr;
  Require(heif_context_encode_image(context.get(), image, encoder, nullptr, &handle));
  if (!tiff.empty()) {
    Require(heif_context_add_exif_metadata(context.get(), handle, tiff.data(),
                                           static_cast<int>(tiff.size())));
  }
  heif_image_handle_release(handle);
  heif_image_release(image);
  heif_encoder_release(encoder);
  std::string bytes;
  heif_writer writer = {
      1, [](heif_context*, const void* data, std::size_t size, void* to) -> heif_error {
        static_cast<std::string*>(to)->assign(static_cast<const char*>(data), size);
        return {heif_error_Ok, heif_suberror_Unspecified, ""};
      }};
  Require(heif_context_write(context.get(), &writer, &bytes));
  return bytes;
}

}  // namespace mono3d
