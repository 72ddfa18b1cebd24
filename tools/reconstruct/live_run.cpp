// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/live_run.h"

#include <cstdio>

namespace mono3d::tools {

std::shared_ptr<LiveInput> ConnectWhereLive(const std::string& input,
                                            const LiveInputOptions& options) {
  if (!IsLiveInput(input)) return nullptr;
  auto live = std::make_shared<LiveInput>(input, options);
  std::printf("%s: images of %dx%d come; Ctrl-C ends the run with its model\n",
              WithoutPassword(input).c_str(), live->width(), live->height());
  std::fflush(stdout);
  return live;
}

CameraPrior FindPriorOf(const std::string& input, const CameraArguments& arguments,
                        const LiveInput* live) {
  if (live == nullptr || !arguments.file.empty()) return FindPrior(input, arguments);
  const bool is_fisheye = arguments.lens == ToString(LensModel::kFisheye);
  return DefaultCameraPrior(live->width(), live->height(),
                            is_fisheye ? LensModel::kFisheye : LensModel::kBrown);
}

void TellOfLiveInput(const LiveInputReport& report) {
  std::printf("images received %lld", static_cast<long long>(report.num_images));
  if (report.num_dropped > 0) {
    std::printf("  not fetched in time %lld", static_cast<long long>(report.num_dropped));
  }
  if (report.num_damaged > 0) {
    std::printf("  damaged %lld", static_cast<long long>(report.num_damaged));
  }
  if (report.num_by_arrival > 0) {
    std::printf("  timed by arrival %lld", static_cast<long long>(report.num_by_arrival));
  }
  if (report.num_reconnects > 0) {
    std::printf("  connected again %lld times, %.1f s missed",
                static_cast<long long>(report.num_reconnects), report.missed_s);
  }
  std::printf("\n");
  if (!report.end.empty()) std::printf("the input ended: %s\n", report.end.c_str());
}

}  // namespace mono3d::tools
