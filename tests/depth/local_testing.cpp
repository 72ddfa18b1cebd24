// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/local_testing.h"

#include <gtest/gtest.h>

#include "depth/local_census.h"

namespace mono3d {

using reference::LocalCensus;
using reference::LocalRange;
using reference::LocalVolume;

Buffer LocalToBuffer(const LocalVolume& volume, LevelSize size) {
  std::vector<std::uint8_t> bytes(kLocalPlanes * NumLocalPixels(size), 0);
  for (std::size_t pixel = 0; pixel < volume.size(); ++pixel) {
    std::copy(volume[pixel].begin(), volume[pixel].end(),
              bytes.begin() + std::ptrdiff_t(kLocalPlanes * LocalIndex(size, pixel)));
  }
  return ToBuffer(bytes);
}

Buffer LocalToBuffer(const std::vector<LocalRange>& ranges, LevelSize size) {
  std::vector<std::uint32_t> words(2 * NumLocalPixels(size), 0);
  for (std::size_t pixel = 0; pixel < ranges.size(); ++pixel) {
    const std::size_t at = 2 * LocalIndex(size, pixel);
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
std::size_t LocalCensusWord(LevelSize size, std::size_t image, std::size_t pixel) {
  const std::size_t x = pixel % size.width_px;
  const std::size_t y = pixel / size.width_px;
  return 4 * (image * NumLocalCensusTexels(size) + 1 + y * 2 * size.groups_per_row() + x / 2);
}

}  // namespace

Buffer LocalToBuffer(const LocalCensus& census, LevelSize size) {
  std::vector<std::uint32_t> words(4 * NumLocalCensusTexels(size) * census.size(), 0);
  for (std::size_t i = 0; i < census.size(); ++i) {
    for (std::size_t pixel = 0; pixel < census[i].size(); ++pixel) {
      const std::size_t at = LocalCensusWord(size, i, pixel) + pixel % size.width_px % 2;
      words[at] = census[i][pixel];
      words[at - 2] = census[i][pixel];  // of the texel before
    }
  }
  return ToBuffer(words);
}

LocalCensus LocalCensusOf(const Buffer& buffer, LevelSize size, std::size_t num_images) {
  const auto words = buffer.Download<std::uint32_t>();
  LocalCensus census(num_images);
  for (std::size_t i = 0; i < num_images; ++i) {
    for (std::size_t pixel = 0; pixel < size.num_pixels(); ++pixel) {
      const std::size_t x = pixel % size.width_px;
      const std::size_t at = LocalCensusWord(size, i, pixel) + x % 2;
      // Pixels from the third of a row on lie in two texels.
      EXPECT_TRUE(x < 2 || words[at] == words[at - 2]);
      census[i].push_back(words[at]);
    }
  }
  return census;
}

LocalVolume LocalVolumeOf(const Buffer& buffer, LevelSize size, std::size_t volume) {
  const auto bytes = buffer.Download<std::uint8_t>();
  LocalVolume result(size.num_pixels());
  for (std::size_t pixel = 0; pixel < result.size(); ++pixel) {
    const std::size_t at = kLocalPlanes * (volume * NumLocalPixels(size) + LocalIndex(size, pixel));
    std::copy_n(bytes.begin() + std::ptrdiff_t(at), kLocalPlanes, result[pixel].begin());
  }
  return result;
}

std::vector<LocalRange> LocalRangesOf(const Buffer& buffer, LevelSize size) {
  const auto words = buffer.Download<std::uint32_t>();
  std::vector<LocalRange> ranges(size.num_pixels());
  for (std::size_t pixel = 0; pixel < ranges.size(); ++pixel) {
    const std::size_t at = 2 * LocalIndex(size, pixel);
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

LocalVolume RandomLocalVolume(LevelSize size, std::uint8_t largest, std::mt19937& random) {
  LocalVolume volume(size.num_pixels());
  for (auto& pixel : volume) {
    for (auto& cost : pixel) cost = static_cast<std::uint8_t>(random() % (largest + 1u));
  }
  return volume;
}

std::vector<LocalRange> RandomLocalRanges(LevelSize size, std::mt19937& random) {
  std::vector<LocalRange> ranges(size.num_pixels());
  for (LocalRange& range : ranges) {
    range.first_plane = static_cast<int>(random() % 24);
    range.grey = static_cast<int>(random() % 256);
    range.narrow = random() % 2 == 0;
    for (int& jump : range.jumps) jump = static_cast<int>(random() % 16) - 8;
  }
  return ranges;
}

}  // namespace mono3d
