// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "report/table.h"

namespace mono3d::tools {

// A picture with the words that go with it: an image, or a drawing as SVG.
struct Figure {
  std::string name;         // stem of its file
  std::string caption;      // what to look for
  std::string alternative;  // what is to be seen, for those who cannot see it
  cv::Mat image;            // 8 bits; empty for a drawing
  std::string svg = {};
  int jpeg_quality = 0;  // of an image on the page, where a loss does no harm; 0: PNG
  bool is_wide = false;  // a drawing as wide as the page
};

// One number that says how well a part went.
struct KeyFigure {
  std::string label;
  std::string value;
  std::string detail;
};

struct Section {
  std::string title;
  std::vector<std::string> paragraphs;
  std::vector<Table> tables;
  std::vector<Figure> figures;
  std::vector<Table> folded_tables;  // long ones, shown when asked for; in HTML only
  std::string html = {};             // as it is, before the tables; in HTML only
};

// A document of measures: text for the terminal, a page to look at.
struct Page {
  std::string title;
  std::string subtitle;
  std::vector<KeyFigure> key_figures;
  std::vector<Section> sections;
  std::string footer;
  // As they are.
  std::string html_after_key_figures = {};
  std::string html_after_sections = {};
};

// The tables and paragraphs.
std::string ToText(const Page& page);
// One self-contained page: pictures and style are in it, and nothing is loaded. No script is run
// but those in Section::html.
std::string ToHtml(const Page& page);
// Parts of it.
std::string KeyFiguresHtml(const Page& page);
std::string SectionsHtml(const Page& page);

// <folder>/<name>.png, or .svg for a drawing, of every figure. Throws Error.
void WritePictures(const std::filesystem::path& folder, const Page& page);

}  // namespace mono3d::tools
