// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/state_json.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

namespace mono3d::tools {
namespace {

using StateRow = std::tuple<std::int64_t, double, std::uint8_t>;

std::vector<StateRow> StateRowsOf(const nlohmann::json& json) {
  std::vector<StateRow> rows;
  ForEachRow<std::int64_t, double, std::uint8_t>(
      json, [&](std::int64_t index, double time_s, std::uint8_t is_tracked) {
        rows.emplace_back(index, time_s, is_tracked);
      });
  return rows;
}

TEST(StateJson, RowsComeBackToTheBit) {
  const std::vector<StateRow> rows = {{-3, 0.1, 1}, {std::int64_t{1} << 60, 1e-300, 0}};
  std::vector<std::uint8_t> bytes;
  for (const auto& [index, time_s, is_tracked] : rows) AddRow(bytes, index, time_s, is_tracked);
  std::string cbor;
  nlohmann::json::to_cbor(nlohmann::json::binary(bytes), cbor);
  EXPECT_EQ(StateRowsOf(StateFromCbor(cbor)), rows);
  EXPECT_EQ(StateRowsOf(nlohmann::json::binary({})), std::vector<StateRow>());
}

TEST(StateJson, RefusesRowsThatAreNotWhole) {
  std::vector<std::uint8_t> bytes;
  AddRow(bytes, std::int64_t{1}, 0.5, std::uint8_t{1});
  bytes.pop_back();
  EXPECT_THROW(StateRowsOf(nlohmann::json::binary(bytes)), Error);
  EXPECT_THROW(StateRowsOf(nlohmann::json::array()), nlohmann::json::exception);
}

}  // namespace
}  // namespace mono3d::tools
