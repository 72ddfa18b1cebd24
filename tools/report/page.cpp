// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "report/page.h"

#include <cstdint>
#include <opencv2/imgcodecs.hpp>

#include "mono3d/core/error.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/output_file.h"
#include "report/base64.h"
#include "report/style.h"

namespace mono3d::tools {
namespace {

std::string DataUri(const Figure& figure) {
  std::vector<std::uint8_t> bytes;
  const bool is_jpeg = figure.jpeg_quality > 0;
  const std::vector<int> settings =
      is_jpeg ? std::vector<int>{cv::IMWRITE_JPEG_QUALITY, figure.jpeg_quality}
              : std::vector<int>{};
  if (!cv::imencode(is_jpeg ? ".jpg" : ".png", figure.image, bytes, settings)) {
    throw Error(ErrorParts{
        .what = "cannot compress the picture", .where = figure.name, .expected = {}, .found = {}});
  }
  return (is_jpeg ? "data:image/jpeg;base64," : "data:image/png;base64,") + ToBase64(bytes);
}

// Within a page the name of the SVG language is understood; the page shall name no address.
std::string WithoutNamespace(std::string svg) {
  const std::string kNamespace = " xmlns=\"http://www.w3.org/2000/svg\"";
  const std::size_t at = svg.find(kNamespace);
  return at == std::string::npos ? svg : svg.erase(at, kNamespace.size());
}

std::string FigureHtml(const Figure& figure) {
  std::string html = "<figure id=\"" + EscapeHtml(figure.name) + "\">\n";
  if (figure.image.empty()) {
    html += "<div class=\"drawing" + std::string(figure.is_wide ? " wide" : "") +
            "\" role=\"img\" aria-label=\"" + EscapeHtml(figure.alternative) + "\">" +
            WithoutNamespace(figure.svg) + "</div>\n";
  } else {
    html += "<img alt=\"" + EscapeHtml(figure.alternative) + "\" width=\"" +
            std::to_string(figure.image.cols) + "\" height=\"" + std::to_string(figure.image.rows) +
            "\" src=\"" + DataUri(figure) + "\">\n";
  }
  return html + "<figcaption>" + EscapeHtml(figure.caption) + "</figcaption>\n</figure>\n";
}

std::string SectionHtml(const Section& section) {
  std::string html = "<section>\n<h2>" + EscapeHtml(section.title) + "</h2>\n";
  for (const std::string& paragraph : section.paragraphs) {
    html += "<p>" + EscapeHtml(paragraph) + "</p>\n";
  }
  html += section.html;
  for (const Table& table : section.tables) html += ToHtml(table);
  for (const Figure& figure : section.figures) html += FigureHtml(figure);
  for (const Table& table : section.folded_tables) {
    html += "<details>\n<summary>" + EscapeHtml(table.title) + "</summary>\n" + ToHtml(table) +
            "</details>\n";
  }
  return html + "</section>\n";
}

}  // namespace

std::string ToText(const Page& page) {
  std::string text = page.title + "\n";
  if (!page.subtitle.empty()) text += page.subtitle + "\n";
  for (const Section& section : page.sections) {
    if (!section.paragraphs.empty()) text += "\n";
    for (const std::string& paragraph : section.paragraphs) text += paragraph + "\n";
    for (const Table& table : section.tables) text += "\n" + ToText(table);
  }
  return text;
}

std::string KeyFiguresHtml(const Page& page) {
  if (page.key_figures.empty()) return {};
  std::string html = "<dl class=\"key\">\n";
  for (const KeyFigure& key : page.key_figures) {
    html += "<div><dt>" + EscapeHtml(key.label) + "</dt><dd><b>" + EscapeHtml(key.value) +
            "</b><span>" + EscapeHtml(key.detail) + "</span></dd></div>\n";
  }
  return html + "</dl>\n";
}

std::string SectionsHtml(const Page& page) {
  std::string html;
  for (const Section& section : page.sections) html += SectionHtml(section);
  return html;
}

std::string ToHtml(const Page& page) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n<title>" +
      EscapeHtml(page.title) + "</title>\n<style>\n" + kStyle +
      "</style>\n</head>\n<body>\n<main>\n<header>\n<h1>" + EscapeHtml(page.title) + "</h1>\n<p>" +
      EscapeHtml(page.subtitle) + "</p>\n</header>\n" + KeyFiguresHtml(page) +
      page.html_after_key_figures + SectionsHtml(page) + page.html_after_sections;
  return html + "<footer>" + EscapeHtml(page.footer) + "</footer>\n</main>\n</body>\n</html>\n";
}

void WritePictures(const std::filesystem::path& folder, const Page& page) {
  CreateOutputFolder(folder);
  for (const Section& section : page.sections) {
    for (const Figure& figure : section.figures) {
      if (figure.image.empty()) {
        WriteFileAtomically(folder / (figure.name + ".svg"), figure.svg);
      } else {
        WritePng(folder / (figure.name + ".png"), figure.image);
      }
    }
  }
}

}  // namespace mono3d::tools
