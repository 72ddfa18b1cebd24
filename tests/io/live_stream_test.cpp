// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Real senders on the loopback: the ffmpeg program, and the RTSP server of GStreamer.

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <thread>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/live_input.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::ThrowsMessage;

constexpr int kSentWidth = 320;
constexpr int kSentHeight = 240;
constexpr double kSentRate = 20;

// A program that runs beside the test and ends with it.
class OtherProgram {
 public:
  // Its output goes to `log`.
  OtherProgram(std::vector<std::string> words, const std::filesystem::path& log) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const std::string log_name = log.string();
    id_ = fork();
    if (id_ != 0) return;
    if (std::freopen("/dev/null", "r", stdin) == nullptr ||
        std::freopen(log_name.c_str(), "w", stdout) == nullptr || dup2(1, 2) < 0) {
      _exit(127);
    }
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  ~OtherProgram() { End(); }
  OtherProgram(const OtherProgram&) = delete;
  OtherProgram& operator=(const OtherProgram&) = delete;

  // As a camera that loses its power.
  void End() {
    if (id_ <= 0) return;
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
    id_ = -1;
  }

  bool HasEnded() {
    if (id_ > 0 && waitpid(id_, nullptr, WNOHANG) == id_) id_ = -1;
    return id_ <= 0;
  }

 private:
  pid_t id_ = -1;
};

// One that nothing listens at.
int FreePort(int type) {
  const int socket_id = socket(AF_INET, type, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  int port = 0;
  if (bind(socket_id, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
      getsockname(socket_id, reinterpret_cast<sockaddr*>(&address), &size) == 0) {
    port = ntohs(address.sin_port);
  }
  close(socket_id);
  return port;
}

bool Exists(const std::string& command) {
  return std::system((command + " >/dev/null 2>&1 </dev/null").c_str()) == 0;
}

class LiveStream : public TemporaryFolderTest {
 protected:
  // Sends a test picture in MPEG-TS, at its rate, until it is ended.
  std::unique_ptr<OtherProgram> SendTo(const std::string& url) const {
    const std::string picture = "testsrc2=size=" + std::to_string(kSentWidth) + "x" +
                                std::to_string(kSentHeight) +
                                ":rate=" + std::to_string(static_cast<int>(kSentRate));
    return std::make_unique<OtherProgram>(
        std::vector<std::string>{"ffmpeg", "-v", "error", "-re", "-f", "lavfi", "-i", picture, "-t",
                                 "120", "-c:v", "mpeg2video", "-g", "5", "-f", "mpegts", url},
        folder_ / "sender.txt");
  }

  // As soon as the sender is there; null after half a minute.
  std::unique_ptr<LiveInput> Connect(const std::string& url, OtherProgram& sender) const {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (true) {
      try {
        return std::make_unique<LiveInput>(url, options_);
      } catch (const Error& error) {
        if (std::chrono::steady_clock::now() > end || sender.HasEnded()) {
          ADD_FAILURE() << error.what() << "\n" << ReadText(folder_ / "sender.txt");
          return nullptr;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
    }
  }

  static CameraModel Camera() {
    return {kSentWidth, kSentHeight, 300, 300, (kSentWidth - 1) / 2.0, (kSentHeight - 1) / 2.0, {}};
  }

  // Of one connection: at the rate of the sender by its stamps, whatever the load of the machine.
  static void ExpectSteadyFrames(FrameSource& frames, int number, double& last_s) {
    for (int i = 0; i < number; ++i) {
      const std::optional<Frame> frame = frames.Next();
      ASSERT_TRUE(frame.has_value());
      ASSERT_NO_THROW(Validate(*frame));
      EXPECT_EQ(frame->bgr.size(), cv::Size(kSentWidth, kSentHeight));
      cv::Scalar mean;
      cv::Scalar deviation;
      cv::meanStdDev(frame->bgr, mean, deviation);
      EXPECT_GT(deviation[0], 20) << "the test picture, and not grey";
      EXPECT_GT(frame->timestamp_s, last_s);
      const double steps = (frame->timestamp_s - last_s) * kSentRate;
      if (i > 2) {
        EXPECT_NEAR(steps, std::round(steps), 0.05) << frame->timestamp_s;
      }
      last_s = frame->timestamp_s;
    }
  }

  // Reads, then ends the sender and starts it again after a while, and reads on.
  void ExpectReconnect(const std::string& sender_url, const std::string& url,
                       std::chrono::milliseconds pause) {
    std::unique_ptr<OtherProgram> sender = SendTo(sender_url);
    const std::unique_ptr<LiveInput> input = Connect(url, *sender);
    ASSERT_NE(input, nullptr);
    EXPECT_EQ(input->width(), kSentWidth);
    EXPECT_EQ(input->height(), kSentHeight);
    const std::unique_ptr<FrameSource> frames = input->Frames(Camera());
    double last_s = -1;
    ASSERT_NO_FATAL_FAILURE(ExpectSteadyFrames(*frames, 12, last_s));
    EXPECT_EQ(input->Report().num_reconnects, 0);
    sender->End();
    std::this_thread::sleep_for(pause);
    sender = SendTo(sender_url);
    // What is left of the first connection comes first.
    for (int i = 0; i < 50 && input->Report().missed_s == 0; ++i) {
      const std::optional<Frame> frame = frames->Next();
      ASSERT_TRUE(frame.has_value()) << input->Report().end;
      EXPECT_GT(frame->timestamp_s, last_s);
      last_s = frame->timestamp_s;
    }
    ASSERT_NO_FATAL_FAILURE(ExpectSteadyFrames(*frames, 12, last_s));
    const LiveInputReport report = input->Report();
    EXPECT_GE(report.num_reconnects, 1);
    EXPECT_GT(report.missed_s, 0);
    EXPECT_GT(last_s, report.missed_s);
    EXPECT_EQ(report.end, "");
  }

  LiveInputOptions options_{.open_timeout_s = 10, .read_timeout_s = 2, .reconnect_s = 60};
};

TEST_F(LiveStream, ByTcpIsReadAndConnectedAgain) {
  ASSERT_TRUE(Exists("ffmpeg -version"));
  const std::string url = "tcp://127.0.0.1:" + std::to_string(FreePort(SOCK_STREAM));
  ExpectReconnect(url + "?listen=1", url, std::chrono::milliseconds(0));
}

TEST_F(LiveStream, ByUdpIsReadAndConnectedAgain) {
  ASSERT_TRUE(Exists("ffmpeg -version"));
  const std::string url = "udp://127.0.0.1:" + std::to_string(FreePort(SOCK_DGRAM));
  // Nothing but silence tells the end of this one.
  ExpectReconnect(url + "?pkt_size=1316", url, std::chrono::milliseconds(2500));
}

TEST_F(LiveStream, ByRtspIsReadAndConnectedAgainAndItsEndIsKnown) {
  const std::string python = "/usr/bin/python3";
  if (!Exists(python + " -c \"import gi; gi.require_version('GstRtspServer', '1.0'); "
                       "from gi.repository import GstRtspServer\"")) {
    GTEST_SKIP() << "the RTSP server of GStreamer is not installed: gir1.2-gst-rtsp-server-1.0, "
                    "gstreamer1.0-plugins-good, python3-gi";
  }
  // The first stream has no end; the second one ends after a few seconds.
  const auto script = WriteText("server.py", R"(
import sys, gi
gi.require_version('Gst', '1.0')
gi.require_version('GstRtspServer', '1.0')
from gi.repository import Gst, GstRtspServer, GLib
Gst.init(None)
server = GstRtspServer.RTSPServer()
server.set_address('127.0.0.1')
server.set_service(sys.argv[1])
for path, number in (('/live', -1), ('/short', 40)):
    factory = GstRtspServer.RTSPMediaFactory()
    factory.set_launch('( videotestsrc num-buffers=%d ! video/x-raw,format=I420,width=320,height=240,'
                       'framerate=20/1 ! jpegenc ! rtpjpegpay name=pay0 pt=26 )' % number)
    server.get_mount_points().add_factory(path, factory)
server.attach(None)
GLib.MainLoop().run()
)");
  const std::string port = std::to_string(FreePort(SOCK_STREAM));
  const auto start = [&] {
    return std::make_unique<OtherProgram>(std::vector<std::string>{python, script.string(), port},
                                          folder_ / "sender.txt");
  };
  std::unique_ptr<OtherProgram> server = start();
  const std::string url = "rtsp://pilot:secret@127.0.0.1:" + port;
  {
    const std::unique_ptr<LiveInput> input = Connect(url + "/live", *server);
    ASSERT_NE(input, nullptr);
    const std::unique_ptr<FrameSource> frames = input->Frames(Camera());
    double last_s = -1;
    ASSERT_NO_FATAL_FAILURE(ExpectSteadyFrames(*frames, 12, last_s));
    server->End();
    server = start();
    while (input->Report().missed_s == 0) {
      const std::optional<Frame> frame = frames->Next();
      ASSERT_TRUE(frame.has_value()) << input->Report().end;
      EXPECT_GT(frame->timestamp_s, last_s);
      last_s = frame->timestamp_s;
    }
    ASSERT_NO_FATAL_FAILURE(ExpectSteadyFrames(*frames, 6, last_s));
    EXPECT_GE(input->Report().num_reconnects, 1);
  }
  const std::unique_ptr<LiveInput> input = Connect(url + "/short", *server);
  ASSERT_NE(input, nullptr);
  const std::unique_ptr<FrameSource> frames = input->Frames(Camera());
  int num_frames = 0;
  while (frames->Next()) ++num_frames;
  EXPECT_GT(num_frames, 5);
  EXPECT_EQ(input->Report().num_reconnects, 0) << "what has ended is not asked for again";
  EXPECT_NE(input->Report().end, "");
  EXPECT_THAT([&] { LiveInput(url + "/none", options_); },
              ThrowsMessage<Error>(AllOf(HasSubstr("127.0.0.1:" + port + "/none"), HasSubstr("404"),
                                         Not(HasSubstr("secret")))));
}

TEST_F(LiveStream, WhereNothingListensIsSaidWithoutThePassword) {
  const std::string address = "127.0.0.1:" + std::to_string(FreePort(SOCK_STREAM));
  for (const char* scheme : {"rtsp://", "tcp://"}) {
    EXPECT_THAT(
        [&] { LiveInput(scheme + ("pilot:secret@" + address), options_); },
        ThrowsMessage<Error>(AllOf(HasSubstr(scheme + address + ": no video"), HasSubstr("ffplay"),
                                   HasSubstr("refused"), Not(HasSubstr("secret")))));
  }
}

// FFmpeg goes by what a stream looks like, unless it is told the form: such a list would have it
// open any file of the machine.
TEST_F(LiveStream, ASenderCannotNameFilesToBeOpened) {
  const auto video = folder_ / "private.ts";
  ASSERT_TRUE(
      Exists("ffmpeg -v error -f lavfi -i testsrc2=size=64x48:rate=20 -t 1 -c:v mpeg2video "
             "-f mpegts " +
             video.string()));
  const auto list = WriteText("list.txt", "ffconcat version 1.0\nfile '" + video.string() + "'\n");
  ASSERT_TRUE(Exists("ffmpeg -v error -safe 0 -i " + list.string() + " -f null -"))
      << "it is one that FFmpeg would follow";
  const int server = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(bind(server, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(listen(server, 1), 0);
  ASSERT_EQ(getsockname(server, reinterpret_cast<sockaddr*>(&address), &size), 0);
  std::thread sender([&] {
    const int connection = accept(server, nullptr, nullptr);
    const std::string text = ReadText(list);
    (void)!write(connection, text.data(), text.size());
    close(connection);
  });
  EXPECT_THROW(LiveInput("tcp://127.0.0.1:" + std::to_string(ntohs(address.sin_port)), options_),
               Error);
  sender.join();
  close(server);
}

}  // namespace
}  // namespace mono3d
