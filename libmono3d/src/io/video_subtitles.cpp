// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/video_subtitles.h"

// FFmpeg itself: OpenCV has no tracks but those of images.
extern "C" {
#include <libavformat/avformat.h>
#include <libavutil/dict.h>
#include <libavutil/log.h>
}

#include <array>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <memory>
#include <string_view>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// A drone writes one for each image at most: five hours at 60 a second.
constexpr std::size_t kMostSubtitles = 1'100'000;

struct CloseContainer {
  void operator()(AVFormatContext* container) const { avformat_close_input(&container); }
};
struct FreePacket {
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};

std::unique_ptr<AVFormatContext, CloseContainer> OpenMp4(const std::filesystem::path& video) {
  av_log_set_level(AV_LOG_QUIET);
  AVDictionary* settings = nullptr;
  // What a file may name is not opened.
  av_dict_set(&settings, "protocol_whitelist", "file", 0);
  av_dict_set(&settings, "format_whitelist", "mov", 0);
  AVFormatContext* container = nullptr;
  const std::string url = "file:" + video.string();
  avformat_open_input(&container, url.c_str(), av_find_input_format("mov"), &settings);
  av_dict_free(&settings);
  return std::unique_ptr<AVFormatContext, CloseContainer>(container);  // null where it failed
}

// The first track of texts; the others are passed over when packets are read.
const AVStream* ChooseTexts(AVFormatContext& container) {
  const AVStream* texts = nullptr;
  for (unsigned int i = 0; i < container.nb_streams; ++i) {
    AVStream& stream = *container.streams[i];
    const bool is_first = texts == nullptr && stream.codecpar->codec_id == AV_CODEC_ID_MOV_TEXT;
    if (is_first) texts = &stream;
    stream.discard = is_first ? AVDISCARD_DEFAULT : AVDISCARD_ALL;
  }
  return texts;
}

// Two bytes with the length of the text, then the text, then boxes with its style (3GPP TS 26.245).
std::string_view TextOf(const AVPacket& packet) {
  constexpr std::size_t kLengthBytes = 2;
  const std::string_view bytes(reinterpret_cast<const char*>(packet.data),
                               static_cast<std::size_t>(packet.size));
  if (bytes.size() < kLengthBytes) return {};
  const std::size_t length = (static_cast<std::size_t>(static_cast<std::uint8_t>(bytes[0])) << 8U) |
                             static_cast<std::uint8_t>(bytes[1]);
  return bytes.substr(kLengthBytes, length);
}

}  // namespace

bool IsMp4(const std::filesystem::path& file) {
  std::array<char, 8> head{};
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  const std::string_view kind(head.data() + 4, 4);
  return kind == "ftyp" || kind == "moov" || kind == "mdat" || kind == "wide" || kind == "free";
}

std::vector<VideoSubtitle> ReadVideoSubtitles(const std::filesystem::path& video) {
  std::vector<VideoSubtitle> subtitles;
  const auto container = OpenMp4(video);
  if (!container) return subtitles;
  const AVStream* texts = ChooseTexts(*container);
  if (texts == nullptr) return subtitles;
  const std::unique_ptr<AVPacket, FreePacket> packet(av_packet_alloc());
  if (!packet) throw Error("no memory", ErrorCode::kOutOfMemory);
  const double tick_s = av_q2d(texts->time_base);
  while (subtitles.size() < kMostSubtitles && av_read_frame(container.get(), packet.get()) >= 0) {
    const bool is_text = packet->stream_index == texts->index && packet->pts != AV_NOPTS_VALUE;
    const std::string_view text = is_text ? TextOf(*packet) : std::string_view();
    // Players show an empty one to take the last text away.
    if (!text.empty()) {
      subtitles.push_back({tick_s * static_cast<double>(packet->pts), std::string(text)});
    }
    av_packet_unref(packet.get());
  }
  return subtitles;
}

}  // namespace mono3d
