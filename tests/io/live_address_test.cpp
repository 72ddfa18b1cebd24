// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/live_address.h"

#include <gmock/gmock.h>

#include "mono3d/core/error.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/live_input.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::ThrowsMessage;

TEST(LiveAddress, IsAStreamOfFewKindsOrAVideoDevice) {
  for (const char* live : {"rtsp://10.0.0.1/live", "rtsps://10.0.0.1/live", "udp://@:1234",
                           "tcp://10.0.0.1:1234", "/dev/video0", "/dev/video12"}) {
    EXPECT_TRUE(IsLiveInput(live)) << live;
  }
  // What FFmpeg would open beside.
  for (const char* other :
       {"file:///etc/passwd", "concat:a|b", "http://10.0.0.1/a.m3u8", "subfile,,start,0,end,9,,:a",
        "rtmp://10.0.0.1/live", "pipe:0", "data:,", "/dev/video", "/dev/videox", "/dev/video0/..",
        "rtsp:", "flight.mp4", ""}) {
    EXPECT_FALSE(IsLiveInput(other)) << other;
    EXPECT_THROW(ParseLiveAddress(other), UsageError) << other;
  }
}

TEST(LiveAddress, IsShownWithoutWhatIsSecret) {
  EXPECT_EQ(WithoutPassword("rtsp://pilot:secret@10.0.0.1:554/live"), "rtsp://10.0.0.1:554/live");
  EXPECT_EQ(WithoutPassword("rtsp://pilot:se@cr/et@10.0.0.1/live"), "rtsp://10.0.0.1/live");
  EXPECT_EQ(WithoutPassword("rtsp://pilot:sec?ret@10.0.0.1/live"), "rtsp://10.0.0.1/live");
  EXPECT_EQ(WithoutPassword("rtsp://10.0.0.1/live?user=a&x=secret"), "rtsp://10.0.0.1/live");
  EXPECT_EQ(WithoutPassword("rtsp://10.0.0.1/user=admin_Password=secret_channel=1"),
            "rtsp://10.0.0.1/...");
  EXPECT_EQ(WithoutPassword("/dev/video0"), "/dev/video0");
  EXPECT_EQ(WithoutPassword("a@b?c.mp4"), "a@b?c.mp4") << "a file";
}

TEST(LiveAddress, WithoutHostOrPortIsRefusedAndItsPasswordNotShown) {
  for (const char* bad : {"udp://10.0.0.1", "tcp://10.0.0.1:0", "udp://10.0.0.1:70000", "udp://:x",
                          "rtsp://", "rtsp://10.0.0.1/a b"}) {
    EXPECT_THROW(ParseLiveAddress(bad), UsageError) << bad;
  }
  EXPECT_THAT([] { ParseLiveAddress("tcp://pilot:secret@10.0.0.1"); },
              ThrowsMessage<UsageError>(AllOf(HasSubstr("tcp://10.0.0.1: the address"),
                                              HasSubstr("HOST:PORT"), Not(HasSubstr("secret")))));
}

TEST(LiveAddress, ReadersOfFilesSayWhatReadsIt) {
  const CameraModel camera{64, 48, 60, 60, 31.5, 23.5, {}};
  EXPECT_THAT([&] { OpenFrameSource("rtsp://pilot:secret@10.0.0.1/live", camera); },
              ThrowsMessage<Error>(AllOf(HasSubstr("only mono3d-reconstruct reads a camera"),
                                         Not(HasSubstr("secret")))));
}

TEST(LiveAddress, ADeviceThatIsNotThereIsSaidSo) {
  EXPECT_THAT([] { LiveInput("/dev/video999"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("/dev/video999: there is no such camera"),
                                         HasSubstr("ls /dev"))));
}

}  // namespace
}  // namespace mono3d
