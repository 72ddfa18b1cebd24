// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Uses something of every stage, so that a library that was installed without one does not link.

#include <mono3d/core/error.h>
#include <mono3d/core/version.h>
#include <mono3d/depth/depth_estimator.h>
#include <mono3d/fusion/surfel_map.h>
#include <mono3d/geometry/pose.h>
#include <mono3d/gpu/device.h>
#include <mono3d/io/frame_source.h>
#include <mono3d/keyframes/keyframe_selector.h>
#include <mono3d/tracking/tracker.h>

#include <exception>
#include <iostream>
#include <memory>

namespace {

void ListTheDevices() {
  for (const mono3d::DeviceInfo& device : mono3d::ListDevices()) {
    std::cout << "device " << device.index << ": " << device.name << '\n';
  }
}

bool OpensNothingThatIsNotThere() {
  try {
    mono3d::OpenFrameSource("no/such/folder", mono3d::CameraModel{});
  } catch (const mono3d::Error&) {
    return true;  // thrown in the library, caught here
  }
  return false;
}

void CreateTheStages() {
  const std::unique_ptr<mono3d::Tracker> tracker = mono3d::CreateTracker();
  const std::unique_ptr<mono3d::KeyframeSelector> selector = mono3d::CreateKeyframeSelector();
  const std::shared_ptr<mono3d::Device> device = mono3d::OpenDevice();
  const std::unique_ptr<mono3d::DepthEstimator> estimator = mono3d::CreateDepthEstimator(device);
  const std::unique_ptr<mono3d::SurfelMap> map = mono3d::CreateSurfelMap(device);
  std::cout << "a new model has " << map->num_surfels() << " surfels\n";
}

}  // namespace

int main() {
  try {
    ListTheDevices();
    CreateTheStages();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  if (!OpensNothingThatIsNotThere()) return 1;
  std::cout << "mono3d " << mono3d::Version() << '\n';
  return 0;
}
