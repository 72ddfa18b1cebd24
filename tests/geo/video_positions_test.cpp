// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

extern "C" {
#include <libavformat/avformat.h>
}

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/geo/position_file.h"

namespace mono3d {
namespace {

using testing::HasSubstr;

// Writes an MP4 file with a track of texts, as drones have it: each `text` for a second.
void WriteTexts(const std::string& path, const std::vector<std::string>& texts) {
  AVFormatContext* container = nullptr;
  ASSERT_GE(avformat_alloc_output_context2(&container, nullptr, "mp4", path.c_str()), 0);
  AVStream* stream = avformat_new_stream(container, nullptr);
  stream->codecpar->codec_type = AVMEDIA_TYPE_SUBTITLE;
  stream->codecpar->codec_id = AV_CODEC_ID_MOV_TEXT;
  stream->time_base = {1, 1000};
  ASSERT_GE(avio_open(&container->pb, path.c_str(), AVIO_FLAG_WRITE), 0);
  ASSERT_GE(avformat_write_header(container, nullptr), 0);
  AVPacket* packet = av_packet_alloc();
  for (std::size_t i = 0; i < texts.size(); ++i) {
    std::string bytes = {static_cast<char>(texts[i].size() >> 8U),
                         static_cast<char>(texts[i].size() & 0xFFU)};
    bytes += texts[i];
    ASSERT_GE(av_new_packet(packet, static_cast<int>(bytes.size())), 0);
    std::memcpy(packet->data, bytes.data(), bytes.size());
    packet->pts = packet->dts =
        av_rescale_q(static_cast<std::int64_t>(i), {1, 1}, stream->time_base);
    packet->duration = av_rescale_q(1, {1, 1}, stream->time_base);
    ASSERT_GE(av_write_frame(container, packet), 0);
    av_packet_unref(packet);
  }
  ASSERT_GE(av_write_trailer(container), 0);
  av_packet_free(&packet);
  avio_closep(&container->pb);
  avformat_free_context(container);
}

class VideoPositions : public TemporaryFolderTest {
 protected:
  std::string Video() const { return (folder_ / "DJI_0001.MP4").string(); }

  void WritePath() const {
    WriteTexts(Video(), {"F/2.8, SS 30.15, GPS (-121.7458, 48.0771, 17), D 1.2m, H 20.70m",
                         "F/2.8, SS 30.15, GPS (-121.7457, 48.0772, 17), D 1.4m, H 20.90m",
                         "F/2.8, SS 30.15, GPS (-121.7456, n\xC3\xBCll, 17), H 21m"});
  }
};

TEST_F(VideoPositions, AreReadFromTheSubtitlesInside) {
  WritePath();
  for (const std::optional<PositionTrack>& track :
       {ReadPositionsOf(Video()), std::optional(ReadPositionFile(Video()))}) {
    ASSERT_TRUE(track.has_value());
    EXPECT_EQ(track->clock, PositionClock::kVideo);
    EXPECT_EQ(track->form, "DJI telemetry");
    ASSERT_EQ(track->fixes.size(), 2U);
    EXPECT_NEAR(track->fixes[1].time_s, 1, 1e-3);
    EXPECT_EQ(track->fixes[1].latitude_deg, 48.0772);
    EXPECT_EQ(track->fixes[1].longitude_deg, -121.7457);
    EXPECT_EQ(track->fixes[1].height_m, 20.9);
    EXPECT_EQ(track->num_unreadable, 1U);
    EXPECT_THAT(track->first_unreadable, HasSubstr("the subtitle at 2.00 s: the position"));
  }
}

TEST_F(VideoPositions, AFileBesideTheVideoGoesBefore) {
  WritePath();
  WriteText(folder_ / "DJI_0001.SRT",
            "1\n00:00:00,000 --> 00:00:01,000\n[latitude: 41.5] [longitude: 2.5]\n");
  const std::optional<PositionTrack> track = ReadPositionsOf(Video());
  ASSERT_TRUE(track.has_value());
  EXPECT_EQ(track->fixes.at(0).latitude_deg, 41.5);
}

TEST_F(VideoPositions, SubtitlesThatAreSpeechAreNone) {
  WriteTexts(Video(), {"Hello.", "What a view!"});
  EXPECT_FALSE(ReadPositionsOf(Video()).has_value());
  try {
    ReadPositionFile(Video());
    FAIL() << "read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("2 entries, the first has no latitude"));
  }
}

// Whatever byte of it is another one, and wherever it ends.
TEST_F(VideoPositions, OfDamagedVideosAreReadOrRefused) {
  WritePath();
  const std::string whole = ReadText(Video());
  std::size_t num_read = 0;
  for (std::size_t at = 0; at < whole.size(); at += 5) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(~static_cast<unsigned char>(damaged[at]));
    WriteText(Video(), damaged);
    try {
      num_read += ReadPositionFile(Video()).fixes.empty() ? 0 : 1;
    } catch (const Error&) {
    }
    WriteText(Video(), whole.substr(0, at));
    EXPECT_NO_THROW(static_cast<void>(ReadPositionsOf(Video())));
  }
  EXPECT_GT(num_read, whole.size() / 20);
}

}  // namespace
}  // namespace mono3d
