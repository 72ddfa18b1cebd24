// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/json_value.h"

#include <nlohmann/json.hpp>
#include <utility>

namespace mono3d {

struct JsonValue::Content {
  nlohmann::ordered_json json;
};

JsonValue::JsonValue(std::unique_ptr<Content> content) : content_(std::move(content)) {}
JsonValue::~JsonValue() = default;
JsonValue::JsonValue(JsonValue&& other) noexcept = default;
JsonValue& JsonValue::operator=(JsonValue&& other) noexcept = default;

JsonValue JsonValue::Object() {
  return JsonValue(std::make_unique<Content>(Content{nlohmann::ordered_json::object()}));
}

JsonValue JsonValue::List() {
  return JsonValue(std::make_unique<Content>(Content{nlohmann::ordered_json::array()}));
}

void JsonValue::Set(const std::string& name, JsonValue value) {
  content_->json[name] = std::move(value.content_->json);
}

void JsonValue::Set(const std::string& name, const std::string& value) {
  content_->json[name] = value;
}

void JsonValue::Set(const std::string& name, double value) { content_->json[name] = value; }
void JsonValue::Set(const std::string& name, bool value) { content_->json[name] = value; }

void JsonValue::SetInteger(const std::string& name, std::int64_t value) {
  content_->json[name] = value;
}

void JsonValue::Append(JsonValue value) {
  content_->json.push_back(std::move(value.content_->json));
}

void JsonValue::Append(std::int64_t value) { content_->json.push_back(value); }

std::string JsonValue::Text() const {
  return content_->json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace mono3d
