// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "report/table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace mono3d::tools {
namespace {

// Characters, not bytes: continuation bytes of UTF-8 do not count.
std::size_t Width(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

std::string Padded(const std::string& text, std::size_t width, bool left) {
  const std::string blanks(width - std::min(width, Width(text)), ' ');
  return left ? text + blanks : blanks + text;
}

std::vector<std::size_t> ColumnWidths(const Table& table) {
  std::vector<std::size_t> widths;
  for (const std::string& column : table.columns) widths.push_back(Width(column));
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths.at(i) = std::max(widths.at(i), Width(row[i]));
    }
  }
  return widths;
}

std::string TextRow(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    line += (i == 0 ? "  " : "   ") + Padded(cells[i], widths.at(i), i == 0);
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line + "\n";
}

std::string MarkdownRow(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (std::string cell : cells) {
    for (std::size_t at = cell.find('|'); at != std::string::npos; at = cell.find('|', at + 2)) {
      cell.insert(at, "\\");
    }
    line += " " + cell + " |";
  }
  return line + "\n";
}

std::string HtmlRow(const std::vector<std::string>& cells, const std::string& scope_of_all) {
  std::string line = "<tr>";
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string scope = !scope_of_all.empty() ? scope_of_all : i == 0 ? "row" : "";
    line += scope.empty() ? "<td>" + EscapeHtml(cells[i]) + "</td>"
                          : "<th scope=\"" + scope + "\">" + EscapeHtml(cells[i]) + "</th>";
  }
  return line + "</tr>\n";
}

}  // namespace

std::string ToText(const Table& table) {
  const std::vector<std::size_t> widths = ColumnWidths(table);
  std::string text = table.title + "\n" + TextRow(table.columns, widths);
  for (const auto& row : table.rows) text += TextRow(row, widths);
  for (const std::string& note : table.notes) text += "  " + note + "\n";
  return text;
}

std::string ToMarkdown(const Table& table) {
  std::string text = "### " + table.title + "\n\n" + MarkdownRow(table.columns) + "|";
  for (std::size_t i = 0; i < table.columns.size(); ++i) text += i == 0 ? " --- |" : " ---: |";
  text += "\n";
  for (const auto& row : table.rows) text += MarkdownRow(row);
  for (const std::string& note : table.notes) text += "\n" + note + "\n";
  return text;
}

std::string ToHtml(const Table& table) {
  // The title stays where it is when the table is scrolled.
  const std::string title = EscapeHtml(table.title);
  std::string html = "<p class=\"title\">" + title +
                     "</p>\n<div class=\"table\" tabindex=\"0\" role=\"region\" aria-label=\"" +
                     title + "\">\n<table>\n<thead>\n" + HtmlRow(table.columns, "col") +
                     "</thead>\n<tbody>\n";
  for (const auto& row : table.rows) html += HtmlRow(row, "");
  html += "</tbody>\n</table>\n</div>\n";
  for (const std::string& note : table.notes) {
    html += "<p class=\"note\">" + EscapeHtml(note) + "</p>\n";
  }
  return html;
}

std::string FormatNumber(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  const int exponent = value == 0 ? 0 : static_cast<int>(std::floor(std::log10(std::abs(value))));
  return FormatFixed(value, std::clamp(digits - 1 - exponent, 0, 9));
}

std::string FormatFixed(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  std::array<char, 400> text{};  // the largest double has 309 digits
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

std::string FormatPercent(double share, int decimals) {
  return std::isfinite(share) ? FormatFixed(100 * share, decimals) + " %" : "-";
}

std::string EscapeHtml(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

}  // namespace mono3d::tools
