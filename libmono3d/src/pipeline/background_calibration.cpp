// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/background_calibration.h"

#include <exception>
#include <thread>
#include <utility>

#include "mono3d/core/thread_priority.h"

namespace mono3d {

CameraCalibration CalibrateInBackground(const CalibrateFunction& calibrate,
                                        const CameraPrior& prior,
                                        std::shared_ptr<const std::vector<CapturedFrame>> footage,
                                        const std::atomic<bool>& is_stopped) {
  CameraCalibration found;
  std::exception_ptr error;
  std::thread worker([&] {
    LowerThreadPriority(ThreadPriority::kThird);
    try {
      found = calibrate(prior, OpenerOf(std::move(footage), is_stopped));
    } catch (...) {
      error = std::current_exception();
    }
  });
  worker.join();
  if (error) std::rethrow_exception(error);
  return found;
}

}  // namespace mono3d
