// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <optional>

namespace mono3d {

// The times of the images of a live input, each later than the one before: by the stamps of the
// stream, and where there are none, or they do not increase or jump, by arrival.
class LiveClock {
 public:
  // Seconds since the first image. `stamp_s`: of the stream, from anywhere on; `arrival_s`: of a
  // monotonic clock.
  double Add(std::optional<double> stamp_s, double arrival_s);

  // The stamps begin anew, as after a break.
  void ForgetStamps() { last_stamp_s_.reset(); }

  // Images whose stamp was of no use.
  std::int64_t num_by_arrival() const { return num_by_arrival_; }

 private:
  bool MayFollow(double stamp_s, double arrival_s) const;

  std::optional<double> last_s_;  // of the image before
  double last_arrival_s_ = 0;
  std::optional<double> last_stamp_s_;
  double shift_s_ = 0;  // from the stamps
  std::int64_t num_by_arrival_ = 0;
};

}  // namespace mono3d
