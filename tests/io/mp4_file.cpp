// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/mp4_file.h"

#include <cstddef>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace mono3d {
namespace {

std::uint32_t NumberAt(const std::string& bytes, std::size_t position) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    number = number << 8U | static_cast<std::uint8_t>(bytes.at(position + i));
  }
  return number;
}

std::string FourBytes(std::uint32_t number) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift & 0xFFU);
  return bytes;
}

std::string BytesOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void SetBytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

// Positions of the boxes on the way to the last one of `names`.
std::vector<std::size_t> WayTo(const std::string& bytes, const std::vector<std::string>& names) {
  std::vector<std::size_t> way;
  std::size_t position = 0;
  std::size_t end = bytes.size();
  for (const std::string& name : names) {
    while (position + 8 <= end && bytes.compare(position + 4, 4, name) != 0) {
      position += NumberAt(bytes, position);
    }
    if (position + 8 > end) throw std::runtime_error("no box " + name);
    way.push_back(position);
    end = position + NumberAt(bytes, position);
    position += 8;
  }
  return way;
}

const std::vector<std::string> kDurations = {"moov", "trak", "mdia", "minf", "stbl", "stts"};

}  // namespace

void SetFrameDurations(const std::filesystem::path& mp4, const std::vector<std::uint32_t>& ticks) {
  std::string bytes = BytesOf(mp4);
  const std::vector<std::size_t> way = WayTo(bytes, kDurations);
  const std::uint32_t size_before = NumberAt(bytes, way.back());
  std::string box = std::string("stts") + FourBytes(0);
  box += FourBytes(static_cast<std::uint32_t>(ticks.size()));
  for (const std::uint32_t duration : ticks) box += FourBytes(1) + FourBytes(duration);
  box = FourBytes(static_cast<std::uint32_t>(box.size() + 4)) + box;
  const auto longer_by = static_cast<std::uint32_t>(box.size()) - size_before;
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    bytes.replace(way[i], 4, FourBytes(NumberAt(bytes, way[i]) + longer_by));
  }
  bytes.replace(way.back(), size_before, box);
  SetBytes(mp4, bytes);
}

std::uint32_t TotalDuration(const std::filesystem::path& mp4) {
  const std::string bytes = BytesOf(mp4);
  const std::size_t box = WayTo(bytes, kDurations).back();
  std::uint32_t total = 0;
  for (std::uint32_t i = 0; i < NumberAt(bytes, box + 12); ++i) {
    total += NumberAt(bytes, box + 16 + 8 * i) * NumberAt(bytes, box + 20 + 8 * i);
  }
  return total;
}

void SetQuarterTurn(const std::filesystem::path& mp4) {
  constexpr std::size_t kMatrix = 8 + 40;  // of version 0
  std::string bytes = BytesOf(mp4);
  const std::size_t box = WayTo(bytes, {"moov", "trak", "tkhd"}).back();
  if (bytes.at(box + 8) != 0) throw std::runtime_error("another version of the box tkhd");
  // a b u c d v x y w in 16.16 and 2.30: x' = a x + c y + x, y' = b x + d y + y.
  const std::uint32_t height = NumberAt(bytes, box + kMatrix + 40);
  std::string matrix;
  for (const std::uint32_t value :
       {0U, 0x10000U, 0U, 0xFFFF0000U, 0U, 0U, height, 0U, 0x40000000U}) {
    matrix += FourBytes(value);
  }
  bytes.replace(box + kMatrix, matrix.size(), matrix);
  SetBytes(mp4, bytes);
}

}  // namespace mono3d
