// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {

// Two archives of one form, so that one function, `template <typename Archive> void
// Exchange(Archive&, T&)`, both writes a type and reads it. Numbers as they lie in the memory of a
// little-endian machine; a count before what may have any length.
static_assert(std::endian::native == std::endian::little, "saved bytes are little endian");

template <typename T>
concept PlainNumber = std::is_arithmetic_v<T>;

class ByteWriter {
 public:
  template <PlainNumber T>
  void Number(T& number) {
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof(T));
  }
  // So many of them, one after the other.
  template <PlainNumber T>
  void Numbers(T* numbers, std::size_t count) {
    bytes_.append(reinterpret_cast<const char*>(numbers), count * sizeof(T));
  }
  void Text(std::string& text) {
    std::uint64_t size = text.size();
    Number(size);
    bytes_ += text;
  }
  template <typename T, typename Function>
  void List(std::vector<T>& list, const Function& exchange) {
    std::uint64_t size = list.size();
    Number(size);
    for (T& member : list) exchange(member);
  }
  template <typename T, typename Function>
  void Optional(std::optional<T>& value, const Function& exchange) {
    std::uint8_t is_there = value ? 1 : 0;
    Number(is_there);
    if (value) exchange(*value);
  }

  // As they lie in memory.
  void Bytes(const void* data, std::size_t num_bytes) {
    bytes_.append(static_cast<const char*>(data), num_bytes);
  }
  // Of members without pointers, as they lie in memory.
  template <typename T>
  void Array(std::vector<T>& array) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::uint64_t size = array.size();
    Number(size);
    Bytes(array.data(), array.size() * sizeof(T));
  }

  // Empty afterwards.
  std::string TakeBytes() { return std::exchange(bytes_, {}); }

 private:
  std::string bytes_;
};

class ByteReader {
 public:
  // Messages begin with `what` it is, "saved map"; `where` names the bytes.
  ByteReader(std::string_view bytes, std::string what, std::string where)
      : bytes_(bytes), what_(std::move(what)), where_(std::move(where)) {}

  template <PlainNumber T>
  void Number(T& number) {
    if (bytes_.size() < sizeof(T)) Refuse("ends too early");
    if constexpr (std::is_same_v<T, bool>) {
      number = bytes_[0] != 0;  // a bool must not hold anything else
    } else {
      std::memcpy(&number, bytes_.data(), sizeof(T));
    }
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(number)) Refuse("a number is not finite");
    }
    bytes_.remove_prefix(sizeof(T));
  }
  template <PlainNumber T>
  void Numbers(T* numbers, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) Number(numbers[i]);
  }
  void Text(std::string& text) {
    const std::uint64_t size = Count();
    text = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
  }
  template <typename T, typename Function>
  void List(std::vector<T>& list, const Function& exchange) {
    const std::uint64_t size = Count();
    list.clear();
    // Not reserved: a member may be a thousand times as large as the byte that tells of it.
    for (std::uint64_t i = 0; i < size; ++i) exchange(list.emplace_back());
  }
  template <typename T, typename Function>
  void Optional(std::optional<T>& value, const Function& exchange) {
    std::uint8_t is_there = 0;
    Number(is_there);
    value.reset();
    if (is_there != 0) exchange(value.emplace(T()));
  }

  void Bytes(void* data, std::size_t num_bytes) {
    if (bytes_.size() < num_bytes) Refuse("ends too early");
    if (num_bytes > 0) std::memcpy(data, bytes_.data(), num_bytes);
    bytes_.remove_prefix(num_bytes);
  }
  template <typename T>
  void Array(std::vector<T>& array) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::uint64_t size = Count();
    if (size > bytes_.size() / sizeof(T)) Refuse("ends too early");
    array.resize(size);
    Bytes(array.data(), size * sizeof(T));
  }

  bool IsAtEnd() const { return bytes_.empty(); }
  std::size_t num_left() const { return bytes_.size(); }
  [[noreturn]] void Refuse(const std::string& why) const {
    throw Error(
        ErrorParts{.what = what_ + ": " + why, .where = where_, .expected = {}, .found = {}});
  }

 private:
  // Each member takes a byte at least: a wild count is found out at once.
  std::uint64_t Count() {
    std::uint64_t count = 0;
    Number(count);
    if (count > bytes_.size()) Refuse("ends too early");
    return count;
  }

  std::string_view bytes_;
  std::string what_;
  std::string where_;
};

}  // namespace mono3d
