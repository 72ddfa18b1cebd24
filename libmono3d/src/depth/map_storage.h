// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace mono3d {

// Images for the results of the stage. Memory that is new to the process costs more than what is
// written to it (each page is made and cleared when it is first touched), so images that were
// handed out are taken again once nobody else refers to them. One thread at a time; those who
// were given images may be others.
class MapStorage {
 public:
  // Of any contents.
  cv::Mat Take(cv::Size size, int type);

 private:
  std::vector<cv::Mat> handed_out_;
  std::size_t next_ = 0;  // is forgotten where all are in use
};

}  // namespace mono3d
