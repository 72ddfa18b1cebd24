// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/video_file.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/imgutils.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include <array>
#include <cmath>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

struct EncoderChoice {
  const char* codec;
  const char* encoder;
  const char* private_option;  // of the encoder
  const char* private_value;
};
// One thread each: what more threads write depends on their number. Key frames come in their
// interval only, as from a camera. x265 prints to the terminal unless it is told not to.
constexpr std::array<EncoderChoice, 2> kEncoders = {
    {{"h264", "libx264", "x264-params", "threads=1:lookahead_threads=1:scenecut=0"},
     {"h265", "libx265", "x265-params", "log-level=none:pools=none:frame-threads=1:scenecut=0"}}};

// The encoders in cameras are no better than this quick setting of the libraries.
constexpr const char* kPreset = "veryfast";
// How long a burst may last: the rate holds over each second.
constexpr double kBuffer_s = 1;

const EncoderChoice& ChooseEncoder(const std::string& codec) {
  for (const EncoderChoice& choice : kEncoders) {
    if (codec == choice.codec) return choice;
  }
  throw Error("no such codec of a video: " + codec);
}

template <auto kFree>
struct FreeByAddress {  // as most of FFmpeg's functions want it
  template <typename T>
  void operator()(T* object) const {
    kFree(&object);
  }
};
struct FreeScaler {
  void operator()(SwsContext* scaler) const { sws_freeContext(scaler); }
};
struct FreeContainer {
  void operator()(AVFormatContext* container) const {
    avio_closep(&container->pb);
    avformat_free_context(container);
  }
};

}  // namespace

class VideoFile::Impl {
 public:
  Impl(const std::filesystem::path& path, const VideoFormat& format)
      : path_(path), size_(format.size), choice_(ChooseEncoder(format.options.codec)) {
    if (size_.width % 2 != 0 || size_.height % 2 != 0) {
      throw Error(
          ErrorParts{.what = "a video has one colour for four pixels",
                     .where = path_,
                     .expected = "an even width and height",
                     .found = std::to_string(size_.width) + "x" + std::to_string(size_.height)});
    }
    av_log_set_level(AV_LOG_FATAL);  // errors are told by exceptions
    OpenEncoder(format);
    OpenContainer();
    OpenFrame();
  }

  void Add(const cv::Mat& bgr) {
    if (bgr.type() != CV_8UC3 || bgr.size() != size_) {
      throw Error("an image of a video has another size or type than the video");
    }
    Require(av_frame_make_writable(frame_.get()));  // the encoder may still look at the last one
    const std::array<const std::uint8_t*, 1> planes = {bgr.data};
    const std::array<int, 1> strides = {static_cast<int>(bgr.step)};
    sws_scale(scaler_.get(), planes.data(), strides.data(), 0, size_.height, frame_->data,
              frame_->linesize);
    frame_->pts = num_frames_++;
    Encode(frame_.get());
  }

  std::int64_t Finish() {
    Encode(nullptr);
    Require(av_write_trailer(container_.get()));
    Require(avio_closep(&container_->pb));
    return 8 * num_bytes_;
  }

 private:
  // `status` is what a function of FFmpeg returned, below 0 for an error.
  void Require(int status) const {
    if (status >= 0) return;
    std::array<char, AV_ERROR_MAX_STRING_SIZE> reason{};
    av_strerror(status, reason.data(), reason.size());
    throw Error(ErrorParts{.what = std::string("cannot write the video: ") + reason.data(),
                           .where = path_,
                           .expected = {},
                           .found = {},
                           .code = ErrorCode::kIo});
  }

  void OpenEncoder(const VideoFormat& format) {
    const AVCodec* codec = avcodec_find_encoder_by_name(choice_.encoder);
    if (codec == nullptr) {
      throw Error(ErrorParts{.what = std::string("this machine's FFmpeg has no ") + choice_.encoder,
                             .where = "--video.codec " + format.options.codec,
                             .expected = {},
                             .found = {},
                             .code = ErrorCode::kUnsupported});
    }
    encoder_.reset(avcodec_alloc_context3(codec));
    const auto bits_per_s = std::llround(1e6 * format.options.bit_rate_mbit_per_s);
    constexpr int kLargestTerm = 100'000;  // of the fraction that stands for the rate
    encoder_->width = size_.width;
    encoder_->height = size_.height;
    encoder_->pix_fmt = AV_PIX_FMT_YUV420P;
    encoder_->framerate = av_d2q(format.frames_per_s, kLargestTerm);
    encoder_->time_base = av_inv_q(encoder_->framerate);
    encoder_->bit_rate = bits_per_s;
    encoder_->rc_max_rate = bits_per_s;
    encoder_->rc_buffer_size = static_cast<int>(kBuffer_s * static_cast<double>(bits_per_s));
    encoder_->gop_size = format.options.keyframe_interval;
    encoder_->max_b_frames = format.options.b_frames;
    encoder_->thread_count = 1;
    // As swscale computes it unless told otherwise, and cv::VideoCapture with it.
    encoder_->colorspace = AVCOL_SPC_SMPTE170M;
    encoder_->color_range = AVCOL_RANGE_MPEG;
    encoder_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_BITEXACT;
    Require(av_opt_set(encoder_->priv_data, "preset", kPreset, 0));
    Require(av_opt_set(encoder_->priv_data, choice_.private_option, choice_.private_value, 0));
    Require(avcodec_open2(encoder_.get(), codec, nullptr));
    packet_.reset(av_packet_alloc());
  }

  void OpenContainer() {
    AVFormatContext* container = nullptr;
    Require(avformat_alloc_output_context2(&container, nullptr, "mp4", path_.c_str()));
    container_.reset(container);
    container_->flags |= AVFMT_FLAG_BITEXACT;  // no version of the library in the file
    stream_ = avformat_new_stream(container_.get(), nullptr);
    stream_->time_base = encoder_->time_base;
    stream_->avg_frame_rate = encoder_->framerate;
    Require(avcodec_parameters_from_context(stream_->codecpar, encoder_.get()));
    Require(avio_open(&container_->pb, path_.c_str(), AVIO_FLAG_WRITE));
    Require(avformat_write_header(container_.get(), nullptr));
  }

  void OpenFrame() {
    frame_.reset(av_frame_alloc());
    frame_->format = encoder_->pix_fmt;
    frame_->width = size_.width;
    frame_->height = size_.height;
    Require(av_frame_get_buffer(frame_.get(), 0));
    scaler_.reset(sws_getContext(
        size_.width, size_.height, AV_PIX_FMT_BGR24, size_.width, size_.height, encoder_->pix_fmt,
        SWS_BICUBIC | SWS_ACCURATE_RND | SWS_BITEXACT, nullptr, nullptr, nullptr));
    if (!scaler_) Require(AVERROR(EINVAL));
  }

  // Hands an image to the encoder, or its end, and writes what comes out.
  void Encode(const AVFrame* frame) {
    Require(avcodec_send_frame(encoder_.get(), frame));
    while (true) {
      const int status = avcodec_receive_packet(encoder_.get(), packet_.get());
      if (status == AVERROR(EAGAIN) || status == AVERROR_EOF) return;
      Require(status);
      num_bytes_ += packet_->size;
      packet_->duration = 1;
      av_packet_rescale_ts(packet_.get(), encoder_->time_base, stream_->time_base);
      packet_->stream_index = stream_->index;
      Require(av_interleaved_write_frame(container_.get(), packet_.get()));
    }
  }

  std::filesystem::path path_;
  cv::Size size_;
  const EncoderChoice& choice_;
  std::unique_ptr<AVCodecContext, FreeByAddress<avcodec_free_context>> encoder_;
  std::unique_ptr<AVFormatContext, FreeContainer> container_;
  std::unique_ptr<AVFrame, FreeByAddress<av_frame_free>> frame_;
  std::unique_ptr<AVPacket, FreeByAddress<av_packet_free>> packet_;
  std::unique_ptr<SwsContext, FreeScaler> scaler_;
  AVStream* stream_ = nullptr;  // of the container
  std::int64_t num_frames_ = 0;
  std::int64_t num_bytes_ = 0;
};

VideoFile::VideoFile(const std::filesystem::path& path, const VideoFormat& format)
    : impl_(std::make_unique<Impl>(path, format)) {}
VideoFile::~VideoFile() = default;
void VideoFile::Add(const cv::Mat& bgr) { impl_->Add(bgr); }
std::int64_t VideoFile::Finish() { return impl_->Finish(); }

}  // namespace mono3d::tools
