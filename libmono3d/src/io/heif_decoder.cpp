// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/heif_decoder.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "io/heif_file.h"
#include "io/image_metadata.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using HeifImage = std::unique_ptr<heif_image, HeifRelease<heif_image_release>>;
using HeifOptions = std::unique_ptr<heif_decoding_options, HeifRelease<heif_decoding_options_free>>;

[[noreturn]] void ThrowHeif(const std::filesystem::path& path, const heif_error& error) {
  throw Error(ErrorParts{.what = "cannot decode the image",
                         .where = path,
                         .expected = {},
                         .found = error.message != nullptr ? error.message : ""});
}

}  // namespace

cv::Mat DecodeHeif(std::string_view bytes, const std::filesystem::path& path) {
  const HeifFile file = OpenHeif(bytes);
  if (!file.primary) ThrowHeif(path, file.error);
  RequireDecodableSize(heif_image_handle_get_ispe_width(file.primary.get()),
                       heif_image_handle_get_ispe_height(file.primary.get()), path);
  const HeifOptions options(heif_decoding_options_alloc());
  options->ignore_transformations = 1;
  heif_image* decoded = nullptr;
  const heif_error error = heif_decode_image(file.primary.get(), &decoded, heif_colorspace_RGB,
                                             heif_chroma_interleaved_RGB, options.get());
  const HeifImage image(decoded);
  if (error.code != heif_error_Ok) ThrowHeif(path, error);
  int stride = 0;
  const std::uint8_t* rows =
      heif_image_get_plane_readonly(image.get(), heif_channel_interleaved, &stride);
  const int width = heif_image_get_width(image.get(), heif_channel_interleaved);
  const int height = heif_image_get_height(image.get(), heif_channel_interleaved);
  if (rows == nullptr || width <= 0 || height <= 0) ThrowHeif(path, error);
  // The header is cv::Mat's only way to look at bytes of others; nothing is written.
  const cv::Mat rgb(height, width, CV_8UC3, const_cast<std::uint8_t*>(rows),
                    static_cast<std::size_t>(stride));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  return bgr;
}

}  // namespace mono3d
