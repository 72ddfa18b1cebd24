// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/core/mat.hpp>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "core/byte_archive.h"
#include "mono3d/image/frame_images.h"

namespace mono3d {

// Two archives for the state of a part of a run, as sections (core/state_sections.h). Everything
// comes back to the bit. `template <typename Archive> void ExchangeState(Archive&, T&)`, or a
// member ExchangeState(Archive&), both writes a type and reads it.

class StateWriter : public ByteWriter {
 public:
  // `kind` of state, "tracker state", and the version of its form. `expected_bytes`: about as long
  // as it is going to be, where that is known; a long one would lie in memory three times while it
  // grows.
  StateWriter(const std::string& kind, std::uint32_t version, SavedImages images,
              std::size_t expected_bytes = 0);

  static constexpr bool kReads = false;

  // What comes is a section of its own. All that has the same place in reading.
  void NextSection();
  // A number that need not be finite.
  void AnyNumber(double& number) { Number(number); }
  void AnyNumber(float& number) { Number(number); }
  void Index(std::size_t& index);
  // A container whose members are sections, so many in each; they may have further ones of their
  // own.
  template <typename List, typename Function>
  void Sections(List& list, std::size_t num_per_section, const Function& exchange) {
    std::uint64_t size = list.size();
    Number(size);
    std::size_t number = 0;
    for (auto& member : list) {
      if (number++ % num_per_section == 0) NextSection();
      exchange(member);
    }
    NextSection();
  }
  // The image of a frame, 8 bit, 1 or 3 channels, or none; once each, however many share it.
  void Image(cv::Mat& image, std::int64_t frame_index);
  // Grey values of an image, where the image itself is no longer kept.
  void Grey(cv::Mat& grey, std::int64_t frame_index) { Image(grey, frame_index); }

  // For FramesOfState: `state` will stand behind this one.
  void TakeFramesOf(std::string_view state, const std::string& where);

  // The whole state so far; to be called once.
  std::string TakeState();

 private:
  using Key = std::tuple<const std::uint8_t*, int, int, std::size_t>;

  SavedImages images_;
  std::map<Key, std::uint64_t> numbers_;  // of the images written so far
  std::set<std::int64_t> frames_;         // that have an image by their index
  std::size_t head_bytes_ = 0;
  std::string state_;  // the head, and what lies behind the list of frames
};

// The frames whose images a state has by their indices alone. Throws Error, which names `where`, on
// bytes that are no state.
std::vector<std::int64_t> FramesOfState(std::string_view state, const std::string& where);

class StateReader : public ByteReader {
 public:
  // `where` names the bytes in messages. `images`: where the state has only their indices. Throws
  // Error on anything that is no such state, or of another version.
  StateReader(std::string_view state, const std::string& kind, std::uint32_t version,
              const std::string& where, const ImageOfFrame& images);

  static constexpr bool kReads = true;

  void NextSection();
  template <typename T>
  void AnyNumber(T& number) {
    using Bits =
        std::conditional_t<sizeof(T) == sizeof(std::uint64_t), std::uint64_t, std::uint32_t>;
    Bits bits = 0;
    Number(bits);
    number = std::bit_cast<T>(bits);
  }
  void Index(std::size_t& index);
  template <typename List, typename Function>
  void Sections(List& list, std::size_t num_per_section, const Function& exchange) {
    std::uint64_t size = 0;
    Number(size);
    if (size > rest_.size()) Refuse("ends too early");  // each takes a byte at least
    list.clear();
    for (std::uint64_t i = 0; i < size; ++i) {
      if (i % num_per_section == 0) NextSection();
      exchange(list.emplace_back());
    }
    NextSection();
  }
  void Image(cv::Mat& image, std::int64_t frame_index);
  void Grey(cv::Mat& grey, std::int64_t frame_index);

  // What lies behind this section, which must have been read.
  std::string_view Rest() const;
  // Throws Error where there is more.
  void CheckEnd() const;

 private:
  void OpenSection();
  cv::Mat ReadImage(std::int64_t frame_index);

  std::string what_;
  std::string where_;
  ImageOfFrame images_;
  std::string_view rest_;          // behind the section that is open
  std::vector<cv::Mat> numbered_;  // in the order in which they came
  std::map<std::int64_t, cv::Mat> by_index_;
};

}  // namespace mono3d
