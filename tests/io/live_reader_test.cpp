// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/live_reader.h"

#include <gmock/gmock.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// A camera whose images the test sends.
class SentImages {
 public:
  void Send(LiveRead::Kind kind, int grey = 0, std::string reason = {}) {
    const std::lock_guard lock(mutex_);
    reads_.push_back(
        {kind, cv::Mat(3, 4, CV_8UC3, cv::Scalar::all(grey)), std::nullopt, std::move(reason)});
  }
  void RefuseConnections() { is_refusing_ = true; }
  void AcceptConnections() { is_refusing_ = false; }
  bool is_refusing() const { return is_refusing_; }

  std::optional<LiveRead> Take() {
    const std::lock_guard lock(mutex_);
    if (reads_.empty()) return std::nullopt;
    LiveRead read = std::move(reads_.front());
    reads_.pop_front();
    return read;
  }

 private:
  std::mutex mutex_;
  std::deque<LiveRead> reads_;
  std::atomic<bool> is_refusing_ = false;
};

class SentConnection : public LiveConnection {
 public:
  SentConnection(SentImages& images, const std::atomic<bool>& is_cancelled)
      : images_(images), is_cancelled_(is_cancelled) {}
  LiveRead Read(double timeout_s) override {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_s);
    while (!is_cancelled_ && std::chrono::steady_clock::now() < end) {
      if (std::optional<LiveRead> read = images_.Take()) return *std::move(read);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return {LiveRead::Kind::kBroken, {}, {}, "nothing came"};
  }

 private:
  SentImages& images_;
  const std::atomic<bool>& is_cancelled_;
};

class LiveReaderTest : public testing::Test {
 protected:
  std::unique_ptr<LiveReader> Connect() {
    return std::make_unique<LiveReader>(
        [this](double, const std::atomic<bool>& is_cancelled) -> std::unique_ptr<LiveConnection> {
          if (camera_.is_refusing()) throw Error("refused");
          return std::make_unique<SentConnection>(camera_, is_cancelled);
        },
        "live", "tcp://there:1", options_);
  }

  // Until the report is so; a minute at most.
  template <typename Holds>
  static bool WaitUntil(const LiveReader& reader, const Holds& holds) {
    for (int i = 0; i < 60'000; ++i) {
      if (holds(reader.Report())) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }

  SentImages camera_;
  LiveInputOptions options_{.open_timeout_s = 60, .read_timeout_s = 60, .reconnect_s = 60};
};

TEST_F(LiveReaderTest, HandsOutTheImagesInOrderFromTheLatestBeforeItBegan) {
  camera_.Send(LiveRead::Kind::kDamaged);
  camera_.Send(LiveRead::Kind::kImage, 10);
  const auto reader = Connect();
  EXPECT_EQ(reader->size(), cv::Size(4, 3));
  reader->Begin();
  camera_.Send(LiveRead::Kind::kImage, 20);
  camera_.Send(LiveRead::Kind::kDamaged);
  camera_.Send(LiveRead::Kind::kImage, 30);
  double last_s = -1;
  for (int i = 0; i < 3; ++i) {
    const auto image = reader->Next(nullptr);
    ASSERT_TRUE(image.has_value());
    EXPECT_EQ(image->index, i);
    EXPECT_EQ(image->name, "live#" + std::to_string(i));
    EXPECT_EQ(image->bgr.at<cv::Vec3b>(0, 0)[0], 10 * (i + 1));
    EXPECT_GT(image->timestamp_s, last_s);
    last_s = image->timestamp_s;
  }
  const LiveInputReport report = reader->Report();
  EXPECT_EQ(report.num_images, 3);
  EXPECT_EQ(report.num_damaged, 1) << "since it began";
  EXPECT_EQ(report.num_reconnects, 0);
  EXPECT_EQ(report.end, "");
}

TEST_F(LiveReaderTest, TheNewestImagesWinWhereNoneIsFetched) {
  camera_.Send(LiveRead::Kind::kImage);
  const auto reader = Connect();
  reader->Begin();
  for (int i = 1; i < 30; ++i) camera_.Send(LiveRead::Kind::kImage);
  ASSERT_TRUE(
      WaitUntil(*reader, [](const LiveInputReport& report) { return report.num_images == 30; }));
  constexpr int kMostWaiting = 8;
  EXPECT_EQ(reader->Report().num_dropped, 30 - kMostWaiting);
  EXPECT_EQ(reader->Next(nullptr)->index, 30 - kMostWaiting);
}

TEST_F(LiveReaderTest, ABrokenConnectionIsMadeAgain) {
  camera_.Send(LiveRead::Kind::kImage);
  const auto reader = Connect();
  reader->Begin();
  ASSERT_TRUE(reader->Next(nullptr).has_value());
  camera_.RefuseConnections();
  camera_.Send(LiveRead::Kind::kBroken);
  std::this_thread::sleep_for(std::chrono::milliseconds(700));  // one attempt at least
  EXPECT_EQ(reader->Report().num_reconnects, 0);
  camera_.AcceptConnections();
  camera_.Send(LiveRead::Kind::kImage, 50);
  const auto image = reader->Next(nullptr);
  ASSERT_TRUE(image.has_value());
  EXPECT_EQ(image->index, 1);
  EXPECT_GE(image->timestamp_s, 0.7) << "time goes on";
  EXPECT_EQ(reader->Report().num_reconnects, 1);
  EXPECT_GE(reader->Report().missed_s, 0.7);
}

TEST_F(LiveReaderTest, EndsWithTheReasonWhereTheConnectionStaysBroken) {
  options_.reconnect_s = 0.8;
  camera_.Send(LiveRead::Kind::kImage);
  const auto reader = Connect();
  reader->Begin();
  camera_.RefuseConnections();
  camera_.Send(LiveRead::Kind::kBroken, 0, "cable");
  EXPECT_TRUE(reader->Next(nullptr).has_value()) << "what came before is not lost";
  EXPECT_FALSE(reader->Next(nullptr).has_value());
  EXPECT_THAT(reader->Report().end, HasSubstr("refused"));
}

TEST_F(LiveReaderTest, EndsAtOnceWhereTheSenderSaysSoOrNothingIsToBeWaitedFor) {
  camera_.Send(LiveRead::Kind::kImage);
  const auto ended = Connect();
  ended->Begin();
  camera_.Send(LiveRead::Kind::kEnded, 0, "that was all");
  EXPECT_TRUE(ended->Next(nullptr).has_value());
  EXPECT_FALSE(ended->Next(nullptr).has_value());
  EXPECT_EQ(ended->Report().end, "that was all");

  options_.reconnect_s = 0;
  camera_.Send(LiveRead::Kind::kImage);
  const auto broken = Connect();
  camera_.Send(LiveRead::Kind::kBroken, 0, "cable");
  ASSERT_TRUE(
      WaitUntil(*broken, [](const LiveInputReport& report) { return !report.end.empty(); }));
  EXPECT_EQ(broken->Report().end, "cable");
}

TEST_F(LiveReaderTest, AStopEndsAWait) {
  camera_.Send(LiveRead::Kind::kImage);
  const auto reader = Connect();
  reader->Begin();
  EXPECT_TRUE(reader->Next(nullptr).has_value());
  const std::atomic<bool> stop = true;
  EXPECT_FALSE(reader->Next(&stop).has_value());
  reader->End();
  camera_.Send(LiveRead::Kind::kImage);
  camera_.Send(LiveRead::Kind::kImage);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_LE(reader->Report().num_images, 2) << "one may have been under way";
}

TEST_F(LiveReaderTest, ThrowsWhereNoImageComes) {
  camera_.Send(LiveRead::Kind::kBroken, 0, "no camera there");
  EXPECT_THAT([&] { Connect(); }, ThrowsMessage<Error>(HasSubstr("no camera there")));
  options_.open_timeout_s = 0.05;
  EXPECT_THAT([&] { Connect(); }, ThrowsMessage<Error>(HasSubstr("tcp://there:1: no image")));
}

}  // namespace
}  // namespace mono3d
