// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// FFmpeg itself and not OpenCV's reader: that takes the protocols that may be used from a variable
// of the environment alone, and cannot be interrupted.
extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/dict.h>
#include <libavutil/log.h>
#include <libswscale/swscale.h>
}

#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "io/live_connection.h"
#include "mono3d/core/error.h"
#include "mono3d/core/timing.h"

namespace mono3d {
namespace {

// What a sender may make the receiver open: no file, no web page, no list of other addresses.
constexpr const char* kProtocols = "rtp,srtp,udp,tcp,tls";
constexpr const char* kFormats = "rtsp,rtp,sdp,mpegts";
constexpr const char* kCodecs = "h264,hevc,mjpeg,mpeg2video,mpeg4,vp8,vp9,libdav1d,libaom-av1,av1";
// Beside that, a stream may name any size: 8K.
constexpr std::int64_t kMaxPixels = 7680LL * 4320;

double StreamClock_s() { return 1e-3 * WallClockMs(); }

template <auto kFree>
struct FreeOfFfmpeg {
  template <typename T>
  void operator()(T* object) const {
    kFree(&object);
  }
};
struct FreeSwsContext {
  void operator()(SwsContext* scaler) const { sws_freeContext(scaler); }
};

std::string WordsOfFfmpeg(int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  return text.data();
}

class Settings {
 public:
  ~Settings() { av_dict_free(&values_); }
  Settings() = default;
  Settings(const Settings&) = delete;
  Settings& operator=(const Settings&) = delete;

  void Set(const char* name, const char* value) { av_dict_set(&values_, name, value, 0); }
  AVDictionary** get() { return &values_; }

 private:
  AVDictionary* values_ = nullptr;
};

class StreamConnection : public LiveConnection {
 public:
  StreamConnection(const LiveAddress& address, double timeout_s,
                   const std::atomic<bool>& is_cancelled)
      : shown_(address.shown), is_cancelled_(is_cancelled) {
    av_log_set_level(AV_LOG_QUIET);
    avformat_network_init();
    deadline_s_ = StreamClock_s() + timeout_s;
    Open(address);
    if (const int error = avformat_find_stream_info(container_.get(), nullptr); error < 0) {
      Fail(error, timeout_s);
    }
    OpenDecoder(timeout_s);
  }

  LiveRead Read(double timeout_s) override {
    deadline_s_ = StreamClock_s() + timeout_s;
    while (true) {
      int error = avcodec_receive_frame(decoder_.get(), frame_.get());
      if (error == 0) return ReadFrame();
      if (error != AVERROR(EAGAIN)) return Broken(error, timeout_s);
      error = av_read_frame(container_.get(), packet_.get());
      if (error < 0) return error == AVERROR_EOF ? AtEnd(timeout_s) : Broken(error, timeout_s);
      const bool is_video = packet_->stream_index == stream_;
      error = is_video ? avcodec_send_packet(decoder_.get(), packet_.get()) : 0;
      av_packet_unref(packet_.get());
      if (error < 0) return {LiveRead::Kind::kDamaged};
      if (is_cancelled_ || StreamClock_s() > deadline_s_) {
        return Broken(AVERROR_EXIT, timeout_s);
      }
    }
  }

 private:
  static int IsInterrupted(void* self) {
    const auto* connection = static_cast<const StreamConnection*>(self);
    return connection->is_cancelled_ || StreamClock_s() > connection->deadline_s_ ? 1 : 0;
  }

  void Open(const LiveAddress& address) {
    Settings settings;
    settings.Set("protocol_whitelist", kProtocols);
    settings.Set("format_whitelist", kFormats);
    settings.Set("codec_whitelist", kCodecs);
    // The size is told by the first headers; rates of streams are of no use.
    settings.Set("analyzeduration", "2000000");
    settings.Set("fpsprobesize", "0");
    const bool is_rtsp = address.kind == LiveKind::kRtsp;
    if (is_rtsp) {
      // Nothing is lost by it, and it comes through routers; UDP where the camera has no other.
      settings.Set("rtsp_flags", "prefer_tcp");
      settings.Set("allowed_media_types", "video");
    }
    const AVInputFormat* format = av_find_input_format(is_rtsp ? "rtsp" : "mpegts");
    AVFormatContext* container = avformat_alloc_context();
    if (container == nullptr || format == nullptr) throw Error("FFmpeg has no reader of streams");
    container->interrupt_callback = {&IsInterrupted, this};
    // Frees the container where it fails.
    const double start_s = StreamClock_s();
    const int error = avformat_open_input(&container, address.url.c_str(), format, settings.get());
    if (error < 0) Fail(error, StreamClock_s() - start_s);
    container_.reset(container);
  }

  void OpenDecoder(double timeout_s) {
    const AVCodec* codec = nullptr;
    stream_ = av_find_best_stream(container_.get(), AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (stream_ < 0 || codec == nullptr)
      Fail(stream_ < 0 ? stream_ : AVERROR_DECODER_NOT_FOUND, timeout_s);
    const AVStream* stream = container_->streams[stream_];
    decoder_.reset(avcodec_alloc_context3(codec));
    if (!decoder_ || !packet_ || !frame_) throw Error("no memory", ErrorCode::kOutOfMemory);
    avcodec_parameters_to_context(decoder_.get(), stream->codecpar);
    decoder_->pkt_timebase = stream->time_base;
    decoder_->max_pixels = kMaxPixels;
    // Threads for frames would hold each image back by as many frames.
    decoder_->thread_type = FF_THREAD_SLICE;
    Settings settings;
    settings.Set("codec_whitelist", kCodecs);
    const int error = avcodec_open2(decoder_.get(), codec, settings.get());
    if (error < 0) Fail(error, timeout_s);
  }

  LiveRead ReadFrame() {
    LiveRead read;
    const AVFrame& frame = *frame_;
    const bool is_damaged =
        (frame.flags & AV_FRAME_FLAG_CORRUPT) != 0 || frame.decode_error_flags != 0;
    if (!is_damaged) read.bgr = ToBgr(frame);
    read.kind = read.bgr.empty() ? LiveRead::Kind::kDamaged : LiveRead::Kind::kImage;
    if (frame.best_effort_timestamp != AV_NOPTS_VALUE) {
      read.stamp_s = static_cast<double>(frame.best_effort_timestamp) *
                     av_q2d(container_->streams[stream_]->time_base);
    }
    av_frame_unref(frame_.get());
    return read;
  }

  cv::Mat ToBgr(const AVFrame& frame) {
    scaler_.reset(sws_getCachedContext(
        scaler_.release(), frame.width, frame.height, static_cast<AVPixelFormat>(frame.format),
        frame.width, frame.height, AV_PIX_FMT_BGR24, SWS_BICUBIC, nullptr, nullptr, nullptr));
    if (!scaler_) return {};
    cv::Mat bgr(frame.height, frame.width, CV_8UC3);
    std::uint8_t* const planes[4] = {bgr.data, nullptr, nullptr, nullptr};
    const int strides[4] = {static_cast<int>(bgr.step), 0, 0, 0};
    sws_scale(scaler_.get(), frame.data, frame.linesize, 0, frame.height, planes, strides);
    return bgr;
  }

  // The end of an RTSP stream that the server told is one where the server is still there; FFmpeg
  // has no other word for a server that has gone.
  LiveRead AtEnd(double timeout_s) {
    LiveRead read = Broken(AVERROR_EOF, timeout_s);
    if (std::strcmp(container_->iformat->name, "rtsp") != 0) return read;
    deadline_s_ = StreamClock_s() + timeout_s;
    if (av_read_pause(container_.get()) >= 0) read.kind = LiveRead::Kind::kEnded;
    return read;
  }

  LiveRead Broken(int error, double timeout_s) const {
    LiveRead read;
    read.reason = Reason(error, timeout_s);
    return read;
  }

  std::string Reason(int error, double timeout_s) const {
    if (error == AVERROR_EOF) return "the sender ended it";
    if (error == AVERROR_EXIT || error == AVERROR(ETIMEDOUT)) {
      if (is_cancelled_) return "told to stop";
      return "no image for " + std::to_string(static_cast<int>(timeout_s + 0.5)) + " s";
    }
    return WordsOfFfmpeg(error);
  }

  [[noreturn]] void Fail(int error, double timeout_s) const {
    throw Error(ErrorParts{
        .what = "no video comes from this address: see that the camera is on, that ffplay shows "
                "it, and that user name and password are right",
        .where = shown_,
        .expected = "H.264, H.265, MJPEG, MPEG-2, MPEG-4, VP8, VP9 or AV1, by RTSP or in MPEG-TS",
        .found = Reason(error, timeout_s),
        .code = ErrorCode::kIo});
  }

  std::string shown_;
  const std::atomic<bool>& is_cancelled_;
  double deadline_s_ = 0;
  int stream_ = -1;
  std::unique_ptr<AVFormatContext, FreeOfFfmpeg<avformat_close_input>> container_;
  std::unique_ptr<AVCodecContext, FreeOfFfmpeg<avcodec_free_context>> decoder_;
  std::unique_ptr<AVPacket, FreeOfFfmpeg<av_packet_free>> packet_{av_packet_alloc()};
  std::unique_ptr<AVFrame, FreeOfFfmpeg<av_frame_free>> frame_{av_frame_alloc()};
  std::unique_ptr<SwsContext, FreeSwsContext> scaler_;
};

}  // namespace

std::unique_ptr<LiveConnection> ConnectToStream(const LiveAddress& address, double timeout_s,
                                                const std::atomic<bool>& is_cancelled) {
  return std::make_unique<StreamConnection>(address, timeout_s, is_cancelled);
}

}  // namespace mono3d
