// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <concepts>
#include <cstdint>
#include <memory>
#include <string>

namespace mono3d {

// A JSON object or list that is put together and written. The library behind it is compiled in one
// place only: its headers alone take longer than the rest of a file of ours.
class JsonValue {
 public:
  static JsonValue Object();
  static JsonValue List();
  ~JsonValue();
  JsonValue(JsonValue&& other) noexcept;
  JsonValue& operator=(JsonValue&& other) noexcept;

  // Of an object: its members are written in the order in which they were first set.
  void Set(const std::string& name, JsonValue value);
  void Set(const std::string& name, const std::string& value);
  void Set(const std::string& name, const char* value) { Set(name, std::string(value)); }
  void Set(const std::string& name, double value);
  void Set(const std::string& name, bool value);
  template <std::integral T>
  void Set(const std::string& name, T value) {
    SetInteger(name, static_cast<std::int64_t>(value));
  }

  // To a list.
  void Append(JsonValue value);
  void Append(std::int64_t value);

  // Indented by two; invalid UTF-8 is replaced.
  std::string Text() const;

 private:
  struct Content;
  explicit JsonValue(std::unique_ptr<Content> content);
  void SetInteger(const std::string& name, std::int64_t value);

  std::unique_ptr<Content> content_;
};

}  // namespace mono3d
