// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

namespace mono3d::tools {

// Figures in rows and columns, ready to print. The first column names the rows.
struct Table {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  // each as long as `columns`
  std::vector<std::string> notes;              // sentences below the table
};

// Columns aligned by blanks, for a terminal. Each ends with a new line.
std::string ToText(const Table& table);
std::string ToMarkdown(const Table& table);
// A <div> that scrolls sideways where the screen is narrow.
std::string ToHtml(const Table& table);

// With `digits` significant ones, never in powers of ten: "0.0234", "117", "1183"; "-" when the
// number is not finite.
std::string FormatNumber(double value, int digits = 4);
// With a fixed number of decimals: "0.876".
std::string FormatFixed(double value, int decimals);
// "97.6 %"
std::string FormatPercent(double share, int decimals = 1);

// The text with &, <, > and quotes as HTML wants them.
std::string EscapeHtml(const std::string& text);

}  // namespace mono3d::tools
