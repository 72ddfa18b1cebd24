// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/io/frame_source.h"

namespace MONO3D_EXPORT mono3d {

struct LiveInputOptions {
  double open_timeout_s = 10;  // until the first image
  double read_timeout_s = 5;   // without an image, after which the connection counts as broken
  double reconnect_s = 60;     // without an image, after which nothing more is waited for; 0: never

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// What became of a live input so far.
struct LiveInputReport {
  std::int64_t num_images = 0;      // decoded, since the first one that was handed out
  std::int64_t num_dropped = 0;     // of them, those that made way for newer ones
  std::int64_t num_damaged = 0;     // not decoded whole, and left out
  std::int64_t num_reconnects = 0;  // connections after the first one
  double missed_s = 0;              // between the images before and after a break, all together
  std::int64_t num_by_arrival = 0;  // images whose time is that of their arrival
  std::string end;                  // why no more images come; empty: they come
};

// Is `input` read by LiveInput: rtsp://, rtsps://, udp:// or tcp:// (MPEG-TS), or /dev/video and a
// number?
bool IsLiveInput(const std::string& input);

// The address as messages and files may show it: without user name, password and parameters.
// Anything else as it is.
std::string WithoutPassword(const std::string& input);

// A camera that sends images now: a stream of the network or a device of Video4Linux. A thread
// takes the images as they come, so that none waits in a buffer of the network; where they are not
// fetched in time, the newest ones win. Streams are received with the protocols of their address
// and no other, in MPEG-TS or RTP, whatever the sender says. A broken connection is made again,
// after waits of 0.5 to 8 s.
//
// The time stamp of an image is that of the stream where it has one and it increases, else that of
// its arrival (monotonic clock); 0 is the first image handed out. The index counts the images that
// came, also those that were dropped.
//
// FFmpeg's own messages are switched off for the process.
class LiveInput {
 public:
  // Connects and waits for the first image. Throws Error where none comes in time, UsageError where
  // the address is none.
  explicit LiveInput(const std::string& address, const LiveInputOptions& options = {});
  // Ends the connection, within a tenth of a second or so.
  ~LiveInput();
  LiveInput(const LiveInput&) = delete;
  LiveInput& operator=(const LiveInput&) = delete;

  // Of the first image, px.
  int width() const;
  int height() const;

  // The images from now on, as OpenFrameSource prepares them. Ends when no more come (a connection
  // that stays broken is no error), after `options.max_frames`, or soon after `*stop` becomes true.
  // Of `options`, fps is to be 0; start and stride count images that came. To be called once. Valid
  // as long as this object.
  std::unique_ptr<FrameSource> Frames(const CameraModel& camera,
                                      const FrameSourceOptions& options = {},
                                      const std::atomic<bool>* stop = nullptr);

  // From any thread.
  LiveInputReport Report() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono3d
