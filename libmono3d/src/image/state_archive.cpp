// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "image/state_archive.h"

#include <cstring>
#include <utility>

#include "core/state_sections.h"
#include "mono3d/core/error.h"
#include "mono3d/image/frame.h"

namespace mono3d {
namespace {

// What stands for an image.
enum class ImageForm : std::uint8_t {
  kNone,
  kNew,    // itself, with the next number
  kKnown,  // the number of one that came before
  kByIndex,
};

std::string HeadOf(const std::string& kind) { return "mono3d " + kind + "\n"; }

template <typename Archive>
void ExchangeForm(Archive& archive, ImageForm& form) {
  auto number = static_cast<std::uint8_t>(form);
  archive.Number(number);
  form = static_cast<ImageForm>(number);
}

}  // namespace

StateWriter::StateWriter(const std::string& kind, std::uint32_t version, SavedImages images,
                         std::size_t expected_bytes)
    : images_(images) {
  state_.reserve(expected_bytes);
  std::string head = HeadOf(kind);
  Text(head);
  Number(version);
  state_ += ToSection(TakeBytes());  // an assignment would replace what was reserved
  head_bytes_ = state_.size();
}

void StateWriter::NextSection() { state_ += ToSection(TakeBytes()); }

void StateWriter::Index(std::size_t& index) {
  std::uint64_t number = index;
  Number(number);
}

void StateWriter::Image(cv::Mat& image, std::int64_t frame_index) {
  ImageForm form = ImageForm::kNone;
  if (image.empty()) return ExchangeForm(*this, form);
  if (images_ == SavedImages::kByIndex) {
    form = ImageForm::kByIndex;
    frames_.insert(frame_index);
    return ExchangeForm(*this, form);
  }
  const auto [known, is_new] =
      numbers_.try_emplace({image.data, image.rows, image.cols, image.step[0]}, numbers_.size());
  form = is_new ? ImageForm::kNew : ImageForm::kKnown;
  ExchangeForm(*this, form);
  if (!is_new) return Number(known->second);
  NextSection();
  int channels = image.channels();
  Number(image.rows);
  Number(image.cols);
  Number(channels);
  const std::size_t row_size = static_cast<std::size_t>(image.cols) * image.elemSize();
  std::uint64_t size = static_cast<std::uint64_t>(image.rows) * row_size;
  Number(size);  // as of a Text
  for (int row = 0; row < image.rows; ++row) Numbers(image.ptr<std::uint8_t>(row), row_size);
  NextSection();
}

void StateWriter::TakeFramesOf(std::string_view state, const std::string& where) {
  const std::vector<std::int64_t> frames = FramesOfState(state, where);
  frames_.insert(frames.begin(), frames.end());
}

std::string StateWriter::TakeState() {
  NextSection();
  std::vector<std::int64_t> frames(frames_.begin(), frames_.end());
  List(frames, [&](std::int64_t& frame) { Number(frame); });
  state_.insert(head_bytes_, ToSection(TakeBytes()));
  return std::move(state_);
}

std::vector<std::int64_t> FramesOfState(std::string_view state, const std::string& where) {
  constexpr const char* kWhat = "state of a run";
  const std::vector<StateSection> sections = SectionsOf(state, kWhat, where);
  constexpr std::size_t kNumbersBefore = 2 * sizeof(std::uint64_t);
  const std::string_view listed = sections.size() < 2 ? std::string_view() : sections[1].bytes;
  if (listed.size() < kNumbersBefore) ByteReader({}, kWhat, where).Refuse("ends too early");
  ByteReader reader(listed.substr(kNumbersBefore), kWhat, where);
  std::vector<std::int64_t> frames;
  reader.List(frames, [&](std::int64_t& frame) { reader.Number(frame); });
  return frames;
}

StateReader::StateReader(std::string_view state, const std::string& kind, std::uint32_t version,
                         const std::string& where, const ImageOfFrame& images)
    : ByteReader({}, kind, where), what_(kind), where_(where), images_(images), rest_(state) {
  const std::string head = HeadOf(kind);
  std::uint64_t head_size = head.size();
  ByteWriter begin;
  begin.Number(head_size);
  const std::string expected = begin.TakeBytes() + head;
  constexpr std::size_t kNumbersBefore = 2 * sizeof(std::uint64_t);
  if (state.size() < kNumbersBefore || !state.substr(kNumbersBefore).starts_with(expected)) {
    Refuse("not one of mono3d");
  }
  OpenSection();
  std::string text;
  std::uint32_t found = 0;
  Text(text);
  Number(found);
  if (found != version) {
    throw Error(ErrorParts{.what = kind + ": of another version; use the mono3d that wrote it, or "
                                          "begin the run anew",
                           .where = where,
                           .expected = "version " + std::to_string(version),
                           .found = "version " + std::to_string(found)});
  }
  NextSection();
  std::vector<std::int64_t> frames;  // of FramesOfState
  List(frames, [&](std::int64_t& frame) { Number(frame); });
  NextSection();
}

void StateReader::OpenSection() {
  ByteReader head(rest_, what_, where_);
  std::uint64_t size = 0;
  std::uint64_t checksum = 0;
  head.Number(size);
  head.Number(checksum);
  rest_.remove_prefix(sizeof(size) + sizeof(checksum));
  if (size > rest_.size()) Refuse("ends too early");
  const std::string_view bytes = rest_.substr(0, size);
  if (ChecksumOf(bytes) != checksum) Refuse("damaged: cut off or changed");
  rest_.remove_prefix(size);
  static_cast<ByteReader&>(*this) = ByteReader(bytes, what_, where_);
}

void StateReader::NextSection() {
  if (!IsAtEnd()) Refuse("contradicts itself");
  OpenSection();
}

void StateReader::Index(std::size_t& index) {
  std::uint64_t number = 0;
  Number(number);
  index = number;
}

cv::Mat StateReader::ReadImage(std::int64_t frame_index) {
  if (!images_) {
    throw UsageError(ErrorParts{.what = what_ + ": saved without its images",
                                .where = where_,
                                .expected = "the images of its frames",
                                .found = "none"});
  }
  cv::Mat& image = by_index_[frame_index];
  if (image.empty()) image = images_(frame_index);
  if (image.type() != CV_8UC3 || image.empty()) {
    throw Error(
        ErrorParts{.what = what_ + ": the image of a frame that it needs is not there",
                   .where = where_,
                   .expected = "the 8-bit colour image of frame " + std::to_string(frame_index),
                   .found = image.empty() ? "none" : cv::typeToString(image.type())});
  }
  return image;
}

void StateReader::Image(cv::Mat& image, std::int64_t frame_index) {
  ImageForm form = ImageForm::kNone;
  ExchangeForm(*this, form);
  if (form == ImageForm::kNone) {
    image.release();
  } else if (form == ImageForm::kByIndex) {
    image = ReadImage(frame_index);
  } else if (form == ImageForm::kKnown) {
    std::uint64_t number = 0;
    Number(number);
    if (number >= numbered_.size()) Refuse("contradicts itself");
    image = numbered_[number];
  } else if (form == ImageForm::kNew) {
    NextSection();
    int rows = 0;
    int cols = 0;
    int channels = 0;
    std::string grey_values;
    Number(rows);
    Number(cols);
    Number(channels);
    Text(grey_values);
    const bool is_image = rows > 0 && cols > 0 && (channels == 1 || channels == 3);
    if (!is_image ||
        grey_values.size() / static_cast<std::size_t>(cols) / static_cast<std::size_t>(channels) !=
            static_cast<std::size_t>(rows) ||
        grey_values.size() %
                (static_cast<std::size_t>(cols) * static_cast<std::size_t>(channels)) !=
            0) {
      Refuse("contradicts itself");
    }
    image.release();  // another one may share it
    image.create(rows, cols, CV_8UC(channels));
    std::memcpy(image.data, grey_values.data(), grey_values.size());
    numbered_.push_back(image);
    NextSection();
  } else {
    Refuse("contradicts itself");
  }
}

void StateReader::Grey(cv::Mat& grey, std::int64_t frame_index) {
  Image(grey, frame_index);
  if (grey.channels() == 3) grey = ToGrey(grey);
}

std::string_view StateReader::Rest() const {
  if (!IsAtEnd()) Refuse("contradicts itself");
  return rest_;
}

void StateReader::CheckEnd() const {
  if (!Rest().empty()) Refuse("contradicts itself");
}

}  // namespace mono3d
