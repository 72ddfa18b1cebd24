// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/model_counts.h"

#include <algorithm>
#include <charconv>
#include <string_view>
#include <utility>
#include <vector>

namespace mono3d {
namespace {

constexpr std::string_view kRange = " to ";

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

double ValueOf(const std::string& number) {
  double value = 0;
  std::from_chars(number.data(), number.data() + number.size(), value);
  return value;
}

// Words, and the number behind them as it is written, or the lowest and highest one of a range.
struct ReasonPart {
  std::string words;
  std::string low;  // empty: no number
  std::string high;

  void Widen(const ReasonPart& other) {
    if (low.empty()) return;
    if (ValueOf(other.low) < ValueOf(low)) low = other.low;
    if (ValueOf(other.high) > ValueOf(high)) high = other.high;
  }
};

std::string TakeNumber(std::string_view text, std::size_t& at) {
  const std::size_t first = at;
  while (at < text.size() && (IsDigit(text[at]) ||
                              (text[at] == '.' && at + 1 < text.size() && IsDigit(text[at + 1])))) {
    ++at;
  }
  return std::string(text.substr(first, at - first));
}

std::vector<ReasonPart> PartsOf(std::string_view text) {
  std::vector<ReasonPart> parts(1);
  std::size_t at = 0;
  while (at < text.size()) {
    if (!IsDigit(text[at])) {
      parts.back().words += text[at++];
      continue;
    }
    ReasonPart& part = parts.back();
    part.low = part.high = TakeNumber(text, at);
    const std::size_t behind = at + kRange.size();
    if (text.substr(at).starts_with(kRange) && behind < text.size() && IsDigit(text[behind])) {
      at = behind;
      part.high = TakeNumber(text, at);
    }
    parts.emplace_back();
  }
  return parts;
}

bool IsOfOneKind(const std::vector<ReasonPart>& a, const std::vector<ReasonPart>& b) {
  return std::ranges::equal(a, b, {}, &ReasonPart::words, &ReasonPart::words);
}

std::string TextOf(const std::vector<ReasonPart>& parts) {
  std::string text;
  for (const ReasonPart& part : parts) {
    text += part.words + part.low;
    if (part.high != part.low) text += std::string(kRange) + part.high;
  }
  return text;
}

}  // namespace

void AddModelCounts(const PipelineCounts& model, PipelineCounts& counts) {
  counts.num_dropped_bundles += model.num_dropped_bundles;
  counts.num_depth_maps += model.num_depth_maps;
  counts.num_fused += model.num_fused;
  counts.num_fused_late += model.num_fused_late;
  counts.num_repairs += model.num_repairs;
  counts.num_submaps_started += model.num_submaps_started;
  counts.num_submaps_joined += model.num_submaps_joined;
  counts.num_models_joined += model.num_models_joined;
  counts.num_corrections += model.num_corrections;
  counts.num_constraints += model.num_constraints;
  for (const auto& [effort, number] : model.reduced_depth_maps) {
    counts.reduced_depth_maps[effort] += number;
  }
  for (const auto& [reason, times] : model.rejected_bundles) {
    CountReason(reason, times, counts.rejected_bundles);
  }
  for (const auto& [reason, times] : model.rejected_depth_maps) {
    CountReason(reason, times, counts.rejected_depth_maps);
  }
}

void CountReason(const std::string& reason, std::int64_t times,
                 std::map<std::string, std::int64_t>& reasons) {
  const std::vector<ReasonPart> parts = PartsOf(reason.empty() ? "no reason given" : reason);
  for (auto known = reasons.begin(); known != reasons.end(); ++known) {
    std::vector<ReasonPart> merged = PartsOf(known->first);
    if (!IsOfOneKind(merged, parts)) continue;
    for (std::size_t i = 0; i < merged.size(); ++i) merged[i].Widen(parts[i]);
    auto node = reasons.extract(known);
    node.key() = TextOf(merged);
    node.mapped() += times;
    reasons.insert(std::move(node));
    return;
  }
  reasons[TextOf(parts)] += times;
}

}  // namespace mono3d
