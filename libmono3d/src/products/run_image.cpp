// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/run_image.h"

#include <string>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/io/image_file.h"

namespace mono3d {

cv::Mat ReadRunImage(const RunImage& image) {
  cv::Mat bgr = ReadImage(image.file);
  if (bgr.cols != image.camera.width || bgr.rows != image.camera.height) {
    throw Error(
        ErrorParts{"image has another size than its camera", image.file.string(),
                   std::to_string(image.camera.width) + "x" + std::to_string(image.camera.height),
                   std::to_string(bgr.cols) + "x" + std::to_string(bgr.rows)});
  }
  return bgr;
}

std::vector<RunImage> ImagesThatAreThere(const FinishedRun& run, const std::string& product) {
  std::vector<RunImage> images;
  for (const RunImage& image : run.images) {
    if (!image.file.empty()) images.push_back(image);
  }
  if (images.empty()) {
    throw Error(ErrorParts{"there are no images for " + product, run.folder.string(),
                           "images/, or the input of the run where it was",
                           std::to_string(run.images.size()) + " keyframes without an image",
                           ErrorCode::kNotFound});
  }
  return images;
}

}  // namespace mono3d
