// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/exr_file.h"

#include <ImathBox.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <half.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <limits>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "io/exr_header.h"
#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

std::string Names(const Imf::ChannelList& channels) {
  std::string names;
  for (auto channel = channels.begin(); channel != channels.end(); ++channel) {
    names += (names.empty() ? "" : " ") + std::string(channel.name());
  }
  return names;
}

// By preference: Z, a layer's Z, Y, a layer's Y, ...; the only channel whatever its name.
std::string DepthChannel(const Imf::ChannelList& channels, const std::filesystem::path& path) {
  for (const std::string wanted : {"Z", "Y", "R", "V"}) {
    if (channels.findChannel(wanted) != nullptr) return wanted;
    for (auto channel = channels.begin(); channel != channels.end(); ++channel) {
      if (std::string_view(channel.name()).ends_with("." + wanted)) return channel.name();
    }
  }
  auto only = channels.begin();
  if (only != channels.end()) {
    const std::string name = only.name();
    if (++only == channels.end()) return name;
  }
  throw Error(ErrorParts{.what = "no channel for depth",
                         .where = path,
                         .expected = "Z, Y, R or V, or one channel",
                         .found = Names(channels)});
}

cv::Rect ToRect(const Imath::Box2i& window, const std::filesystem::path& path) {
  constexpr int kMaxSide_px = std::numeric_limits<std::int16_t>::max();
  // In 64 bits, as a broken header may hold anything.
  const auto width = static_cast<std::int64_t>(window.max.x) - window.min.x + 1;
  const auto height = static_cast<std::int64_t>(window.max.y) - window.min.y + 1;
  constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;  // as of other images
  if (width < 1 || height < 1 || width > kMaxSide_px || height > kMaxSide_px ||
      width * height > kMaxPixels) {
    throw Error(ErrorParts{.what = "bad image size in the header",
                           .where = path,
                           .expected = "1 to 32767, 268 million pixels at most",
                           .found = std::to_string(width) + "x" + std::to_string(height)});
  }
  return {window.min.x, window.min.y, static_cast<int>(width), static_cast<int>(height)};
}

cv::Mat ReadChannel(Imf::InputFile& file, const std::string& name,
                    const std::filesystem::path& path) {
  const Imf::ChannelList& channels = file.header().channels();
  const Imf::Channel& channel = channels[name];
  if (channel.xSampling != 1 || channel.ySampling != 1) {
    throw Error(ErrorParts{.what = "channel " + name + " is not of full size",
                           .where = path,
                           .expected = "sampling 1",
                           .found = std::to_string(channel.xSampling)});
  }
  const Imath::Box2i& window = file.header().dataWindow();
  const cv::Rect data = ToRect(window, path);
  const cv::Rect display = ToRect(file.header().displayWindow(), path);
  cv::Mat values(data.size(), CV_32FC1, cv::Scalar(0));
  Imf::FrameBuffer buffer;
  buffer.insert(name,
                Imf::Slice::Make(Imf::FLOAT, values.data, window, sizeof(float), values.step));
  file.setFrameBuffer(buffer);
  file.readPixels(window.min.y, window.max.y);
  if (data == display) return values;
  cv::Mat image(display.size(), CV_32FC1, cv::Scalar(0));
  const cv::Rect shared = data & display;
  if (!shared.empty()) values(shared - data.tl()).copyTo(image(shared - display.tl()));
  return image;
}

constexpr std::array kColours = {"R", "G", "B"};

template <typename ReadPart>
cv::Mat ReadExr(const std::filesystem::path& path, const ReadPart& read) {
  RequireSoundExrHeaders(ReadBytes(path), path);
  try {
    Imf::InputFile file(path.c_str());
    return read(file);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& exception) {
    throw Error(
        ErrorParts{.what = std::string("cannot read the OpenEXR image: ") + exception.what(),
                   .where = path,
                   .expected = {},
                   .found = {}});
  }
}

}  // namespace

bool IsExr(std::string_view bytes) { return bytes.starts_with("\x76\x2F\x31\x01"); }

cv::Mat ReadExrDepth(const std::filesystem::path& path) {
  return ReadExr(path, [&](Imf::InputFile& file) {
    return ReadChannel(file, DepthChannel(file.header().channels(), path), path);
  });
}

cv::Mat ReadExrColours(const std::filesystem::path& path) {
  return ReadExr(path, [&](Imf::InputFile& file) {
    const Imf::ChannelList& channels = file.header().channels();
    std::vector<cv::Mat> colours;
    for (const char* name : kColours) {
      if (channels.findChannel(name) == nullptr) {
        throw Error(ErrorParts{.what = "no channel of that name",
                               .where = path,
                               .expected = name,
                               .found = Names(channels)});
      }
      colours.push_back(ReadChannel(file, name, path));
    }
    cv::Mat image;
    cv::merge(colours, image);
    return image;
  });
}

std::string ExrBytes(const cv::Mat& image, bool is_half) {
  const Imf::PixelType type = is_half ? Imf::HALF : Imf::FLOAT;
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  Imf::Header header(image.cols, image.rows);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer buffer;
  std::vector<std::vector<Imath::half>> halves;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const std::string name = channels.size() == 1 ? "Z" : kColours.at(i);
    header.channels().insert(name, Imf::Channel(type));
    char* data = reinterpret_cast<char*>(channels[i].data);
    if (is_half) {
      halves.emplace_back(channels[i].begin<float>(), channels[i].end<float>());
      data = reinterpret_cast<char*>(halves.back().data());
    }
    const std::size_t pixel = is_half ? sizeof(Imath::half) : sizeof(float);
    buffer.insert(name,
                  Imf::Slice(type, data, pixel, pixel * static_cast<std::size_t>(image.cols)));
  }
  Imf::StdOSStream stream;
  {
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(buffer);
    file.writePixels(image.rows);
  }
  return stream.str();
}

}  // namespace mono3d
