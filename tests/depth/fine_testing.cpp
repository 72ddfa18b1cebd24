// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/fine_testing.h"

#include <gtest/gtest.h>

namespace mono3d {

using reference::FineCensus;
using reference::FineRange;
using reference::FineVolume;

Buffer FineToBuffer(const FineVolume& volume, LevelSize size) {
  std::vector<std::uint8_t> bytes(kFinePlanes * NumFinePixels(size), 0);
  for (std::size_t pixel = 0; pixel < volume.size(); ++pixel) {
    std::copy(volume[pixel].begin(), volume[pixel].end(),
              bytes.begin() + std::ptrdiff_t(kFinePlanes * FineIndex(size, pixel)));
  }
  return ToBuffer(bytes);
}

Buffer FineToBuffer(const std::vector<FineRange>& ranges, LevelSize size) {
  std::vector<std::uint32_t> words(2 * NumFinePixels(size), 0);
  for (std::size_t pixel = 0; pixel < ranges.size(); ++pixel) {
    const std::size_t at = 2 * FineIndex(size, pixel);
    words[at] = static_cast<std::uint32_t>(ranges[pixel].first_plane) |
                static_cast<std::uint32_t>(ranges[pixel].grey) << 16 |
                (ranges[pixel].narrow ? 1u << 24 : 0u);
    for (std::size_t i = 0; i < ranges[pixel].jumps.size(); ++i) {
      words[at + 1] |= (static_cast<std::uint32_t>(ranges[pixel].jumps[i]) & 15u) << (4 * i);
    }
  }
  return ToBuffer(words);
}

namespace {

// Number of the first word of a texel.
std::size_t FineCensusWord(LevelSize size, std::size_t image, std::size_t pixel) {
  const std::size_t x = pixel % size.width_px;
  const std::size_t y = pixel / size.width_px;
  return 2 * (image * NumFineCensusTexels(size) + 2 + y * 4 * size.groups_per_row() + x);
}

}  // namespace

Buffer FineToBuffer(const FineCensus& census, LevelSize size) {
  std::vector<std::uint32_t> words(2 * NumFineCensusTexels(size) * census.size(), 0);
  for (std::size_t i = 0; i < census.size(); ++i) {
    for (std::size_t pixel = 0; pixel < census[i].size(); ++pixel) {
      const std::size_t at = FineCensusWord(size, i, pixel);
      words[at] = census[i][pixel];
      words[at - 1] = census[i][pixel];  // of the texel before
    }
  }
  return ToBuffer(words);
}

FineCensus FineCensusOf(const Buffer& buffer, LevelSize size, std::size_t num_images) {
  const auto words = buffer.Download<std::uint32_t>();
  FineCensus census(num_images);
  for (std::size_t i = 0; i < num_images; ++i) {
    for (std::size_t pixel = 0; pixel < size.num_pixels(); ++pixel) {
      const std::size_t x = pixel % size.width_px;
      const std::size_t at = FineCensusWord(size, i, pixel);
      // Pixels from the second of a row on lie in two texels.
      EXPECT_TRUE(x < 1 || words[at] == words[at - 1]);
      census[i].push_back(words[at]);
    }
  }
  return census;
}

FineVolume FineVolumeOf(const Buffer& buffer, LevelSize size, std::size_t volume) {
  const auto bytes = buffer.Download<std::uint8_t>();
  FineVolume result(size.num_pixels());
  for (std::size_t pixel = 0; pixel < result.size(); ++pixel) {
    const std::size_t at = kFinePlanes * (volume * NumFinePixels(size) + FineIndex(size, pixel));
    std::copy_n(bytes.begin() + std::ptrdiff_t(at), kFinePlanes, result[pixel].begin());
  }
  return result;
}

std::vector<FineRange> FineRangesOf(const Buffer& buffer, LevelSize size) {
  const auto words = buffer.Download<std::uint32_t>();
  std::vector<FineRange> ranges(size.num_pixels());
  for (std::size_t pixel = 0; pixel < ranges.size(); ++pixel) {
    const std::size_t at = 2 * FineIndex(size, pixel);
    ranges[pixel].first_plane = static_cast<int>(words[at] & 0xffffu);
    ranges[pixel].grey = static_cast<int>((words[at] >> 16) & 0xffu);
    ranges[pixel].narrow = (words[at] >> 24) != 0;
    for (std::size_t i = 0; i < ranges[pixel].jumps.size(); ++i) {
      const int bits = static_cast<int>((words[at + 1] >> (4 * i)) & 15u);
      ranges[pixel].jumps[i] = bits < 8 ? bits : bits - 16;
    }
  }
  return ranges;
}

FineVolume RandomFineVolume(LevelSize size, std::uint8_t largest, std::mt19937& random) {
  FineVolume volume(size.num_pixels());
  for (auto& pixel : volume) {
    for (auto& cost : pixel) cost = static_cast<std::uint8_t>(random() % (largest + 1u));
  }
  return volume;
}

std::vector<FineRange> RandomFineRanges(LevelSize size, std::mt19937& random) {
  std::vector<FineRange> ranges(size.num_pixels());
  for (FineRange& range : ranges) {
    range.first_plane = static_cast<int>(random() % 24);
    range.grey = static_cast<int>(random() % 256);
    range.narrow = random() % 2 == 0;
    for (int& jump : range.jumps) jump = static_cast<int>(random() % 16) - 8;
  }
  return ranges;
}

}  // namespace mono3d
