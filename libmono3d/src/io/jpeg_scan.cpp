// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/jpeg_scan.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace mono3d {
namespace {

constexpr int kMaxCodeBits = 16;
constexpr int kNumCoefficients = 64;

// The bytes of a segment, or of a scan; reads 0 behind their end and says so.
class JpegBytes {
 public:
  explicit JpegBytes(std::string_view bytes) : bytes_(bytes) {}

  int Next() {
    if (position_ >= bytes_.size()) {
      is_complete_ = false;
      return 0;
    }
    return static_cast<std::uint8_t>(bytes_[position_++]);
  }
  int NextPair() {
    const int upper = Next();
    return upper << 8 | Next();
  }
  bool is_at_end() const { return position_ >= bytes_.size(); }
  bool is_complete() const { return is_complete_; }

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;
  bool is_complete_ = true;
};

// The bits of a scan, without the zeros behind its bytes 0xFF.
class ScanBits {
 public:
  explicit ScanBits(std::string_view bytes) : bytes_(bytes) {}

  // Nothing at a marker or at the end.
  std::optional<int> Next() {
    if (num_bits_ == 0 && !TakeByte()) return std::nullopt;
    --num_bits_;
    return byte_ >> num_bits_ & 1;
  }

  bool Skip(int num) {
    for (; num > 0; --num) {
      if (!Next()) return false;
    }
    return true;
  }

  // Is there nothing but what fills the last byte before a marker that ends the image?
  bool IsAtEndOfImage() const {
    const int filling = (1 << num_bits_) - 1;
    return (byte_ & filling) == filling && bytes_.substr(position_).starts_with("\xFF\xD9");
  }

  // To behind the restart marker that follows; false: there is none.
  bool Restart() {
    num_bits_ = 0;
    while (TakeByte()) num_bits_ = 0;  // what hardware left
    const std::string_view rest = bytes_.substr(position_);
    if (rest.size() < 2 || (static_cast<std::uint8_t>(rest[1]) & 0xF8) != 0xD0) return false;
    position_ += 2;
    return true;
  }

 private:
  bool TakeByte() {
    if (position_ >= bytes_.size()) return false;
    byte_ = static_cast<std::uint8_t>(bytes_[position_]);
    const std::size_t length = byte_ == 0xFF ? 2 : 1;
    if (length == 2 && (position_ + 1 >= bytes_.size() || bytes_[position_ + 1] != '\0')) {
      byte_ = 0;
      return false;
    }
    position_ += length;
    num_bits_ = 8;
    return true;
  }

  std::string_view bytes_;
  std::size_t position_ = 0;
  int byte_ = 0;
  int num_bits_ = 0;  // of it, that are still to come
};

// T.81, annex C and F.2.2.3.
class HuffmanCodes {
 public:
  void Read(JpegBytes& bytes) {
    std::array<int, kMaxCodeBits> counts{};
    for (int& count : counts) count = bytes.Next();
    symbols_.clear();
    int code = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      first_symbol_[i] = static_cast<int>(symbols_.size()) - code;
      for (int j = 0; j < counts[i]; ++j) symbols_.push_back(bytes.Next());
      code += counts[i];
      end_[i] = code;
      code <<= 1;
    }
  }

  std::optional<int> Next(ScanBits& bits) const {
    int code = 0;
    for (std::size_t i = 0; i < kMaxCodeBits; ++i) {
      const std::optional<int> bit = bits.Next();
      if (!bit) return std::nullopt;
      code = code << 1 | *bit;
      if (code >= end_[i]) continue;
      const int index = first_symbol_[i] + code;
      if (index < 0 || index >= static_cast<int>(symbols_.size())) return std::nullopt;
      return symbols_[static_cast<std::size_t>(index)];
    }
    return std::nullopt;
  }

 private:
  std::array<int, kMaxCodeBits> end_{};  // of the codes of i + 1 bits
  std::array<int, kMaxCodeBits> first_symbol_{};
  std::vector<int> symbols_;
};

struct ScanComponent {
  int id = 0;
  int sampling_x = 1;
  int sampling_y = 1;
  const HuffmanCodes* dc = nullptr;
  const HuffmanCodes* ac = nullptr;
};

// A file with one sequential scan, coded by Huffman codes that it has itself.
class SequentialJpeg {
 public:
  // False: it is none.
  bool ReadHead(std::string_view jpeg) {
    std::size_t position = 2;
    while (position + 4 <= jpeg.size()) {
      if (jpeg[position] != '\xFF' || jpeg[position + 1] == '\xFF') {
        ++position;
        continue;
      }
      const int marker = static_cast<std::uint8_t>(jpeg[position + 1]);
      JpegBytes length_bytes(jpeg.substr(position + 2, 2));
      const auto length = static_cast<std::size_t>(length_bytes.NextPair());
      if (length < 2 || position + 2 + length > jpeg.size()) return false;
      JpegBytes segment(jpeg.substr(position + 4, length - 2));
      position += 2 + length;
      constexpr int kStartOfScan = 0xDA;
      if (!ReadSegment(marker, segment) || !segment.is_complete()) return false;
      if (marker != kStartOfScan) continue;
      scan_ = jpeg.substr(position);
      return true;
    }
    return false;
  }

  bool IsDamaged() const {
    ScanBits bits(scan_);
    const std::int64_t num_units = NumUnits();
    for (std::int64_t i = 0; i < num_units; ++i) {
      const bool is_restart = restart_interval_ > 0 && i > 0 && i % restart_interval_ == 0;
      if ((is_restart && !bits.Restart()) || !PassUnit(bits)) return true;
    }
    if (bits.IsAtEndOfImage()) return false;
    while (PassUnit(bits)) {
      if (bits.IsAtEndOfImage()) return true;
    }
    return false;
  }

 private:
  bool ReadSegment(int marker, JpegBytes& segment) {
    switch (marker) {
      case 0xC0:  // sequential, with 8 or with 12 bits
      case 0xC1:
        return ReadFrame(segment);
      case 0xC4:
        return ReadCodes(segment);
      case 0xDD:
        restart_interval_ = segment.NextPair();
        return true;
      case 0xDA:
        return ReadScan(segment);
      default:
        return marker < 0xC0 || marker > 0xCF;  // of other ways to code
    }
  }

  bool ReadFrame(JpegBytes& segment) {
    segment.Next();  // bits of a value
    height_ = segment.NextPair();
    width_ = segment.NextPair();
    components_.clear();
    for (int num = segment.Next(); num > 0 && segment.is_complete(); --num) {
      ScanComponent component;
      component.id = segment.Next();
      const int sampling = segment.Next();
      component.sampling_x = sampling >> 4;
      component.sampling_y = sampling & 0xF;
      segment.Next();  // quantisation
      if (component.sampling_x < 1 || component.sampling_y < 1) return false;
      components_.push_back(component);
    }
    return true;
  }

  bool ReadCodes(JpegBytes& segment) {
    while (!segment.is_at_end()) {
      const int table = segment.Next();
      const std::size_t index = static_cast<std::size_t>(table) & 0xF;
      if (table >> 4 > 1 || index >= codes_[0].size()) return false;
      codes_[static_cast<std::size_t>(table) >> 4][index].Read(segment);
    }
    return true;
  }

  // Of all components.
  bool ReadScan(JpegBytes& segment) {
    if (components_.empty()) return false;
    if (static_cast<std::size_t>(segment.Next()) != components_.size()) return false;
    for (ScanComponent& component : components_) {
      const int id = segment.Next();
      const auto tables = static_cast<std::size_t>(segment.Next());
      if (id != component.id || tables >> 4 >= codes_[0].size() ||
          (tables & 0xF) >= codes_[1].size()) {
        return false;
      }
      component.dc = &codes_[0][tables >> 4];
      component.ac = &codes_[1][tables & 0xF];
    }
    return true;
  }

  // How many there are of the units into which blocks of all components are put.
  std::int64_t NumUnits() const {
    constexpr int kBlock_px = 8;
    int unit_width = kBlock_px;
    int unit_height = kBlock_px;
    if (components_.size() > 1) {
      for (const ScanComponent& component : components_) {
        unit_width = std::max(unit_width, kBlock_px * component.sampling_x);
        unit_height = std::max(unit_height, kBlock_px * component.sampling_y);
      }
    }
    return std::int64_t{(width_ + unit_width - 1) / unit_width} *
           ((height_ + unit_height - 1) / unit_height);
  }

  bool PassUnit(ScanBits& bits) const {
    for (const ScanComponent& component : components_) {
      const bool is_alone = components_.size() == 1;  // a unit is then a block
      const int num_blocks = is_alone ? 1 : component.sampling_x * component.sampling_y;
      for (int i = 0; i < num_blocks; ++i) {
        if (!PassBlock(component, bits)) return false;
      }
    }
    return true;
  }

  static bool PassBlock(const ScanComponent& component, ScanBits& bits) {
    const std::optional<int> num_dc_bits = component.dc->Next(bits);
    if (!num_dc_bits || !bits.Skip(*num_dc_bits & 0xF)) return false;
    for (int k = 1; k < kNumCoefficients;) {
      const std::optional<int> symbol = component.ac->Next(bits);
      if (!symbol) return false;
      const int num_zeros = *symbol >> 4;
      const int num_bits = *symbol & 0xF;
      constexpr int kSixteenZeros = 15;
      if (num_bits == 0 && num_zeros != kSixteenZeros) return true;  // end of the block
      k += num_zeros + 1;
      if (k > kNumCoefficients || !bits.Skip(num_bits)) return false;
    }
    return true;
  }

  int width_ = 0;
  int height_ = 0;
  int restart_interval_ = 0;                          // in units; 0: none
  std::array<std::array<HuffmanCodes, 4>, 2> codes_;  // of DC and of AC
  std::vector<ScanComponent> components_;
  std::string_view scan_;
};

}  // namespace

bool IsScanDamaged(std::string_view jpeg) {
  SequentialJpeg file;
  return file.ReadHead(jpeg) && file.IsDamaged();
}

}  // namespace mono3d
