// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/opencv_xml.h"

#include <expat.h>

#include <algorithm>
#include <climits>
#include <cstddef>
#include <iterator>
#include <memory>
#include <new>
#include <string_view>
#include <vector>

#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

struct XmlKey {
  std::string name;
  std::size_t line = 0;
  std::string text;
  std::vector<XmlKey> keys;
};

struct XmlCollector {
  XML_Parser parser;
  std::string root;  // the outermost element
  int depth = 0;
  std::vector<XmlKey> keys;
};

constexpr int kDepthOfKey = 2;  // below the root

XmlKey* OpenKey(XmlCollector& collector) {
  if (collector.depth < kDepthOfKey || collector.depth > kDepthOfKey + 1) return nullptr;
  XmlKey& key = collector.keys.back();
  return collector.depth == kDepthOfKey ? &key : &key.keys.back();
}

void OnXmlStart(void* user, const XML_Char* name, const XML_Char** /*attributes*/) {
  auto& collector = *static_cast<XmlCollector*>(user);
  ++collector.depth;
  const XmlKey key{name, XML_GetCurrentLineNumber(collector.parser), {}, {}};
  if (collector.depth == 1) collector.root = name;
  if (collector.depth == kDepthOfKey) collector.keys.push_back(key);
  if (collector.depth == kDepthOfKey + 1) collector.keys.back().keys.push_back(key);
}

void OnXmlEnd(void* user, const XML_Char* /*name*/) { --static_cast<XmlCollector*>(user)->depth; }

void OnXmlText(void* user, const XML_Char* text, int length) {
  XmlKey* key = OpenKey(*static_cast<XmlCollector*>(user));
  if (key != nullptr) key->text.append(text, static_cast<std::size_t>(length));
}

// These files have none; its entities could make a small file large.
void OnXmlDocumentType(void* user, const XML_Char* /*name*/, const XML_Char* /*system_id*/,
                       const XML_Char* /*public_id*/, int /*has_internal_subset*/) {
  XML_StopParser(static_cast<XmlCollector*>(user)->parser, XML_FALSE);
}

// As YAML, whatever it holds.
std::string Quoted(std::string_view word) {
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted + "'";
}

// Between blanks; text between quotation marks is one.
std::vector<std::string> WordsOf(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  std::vector<std::string> words;
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
    if (text.empty()) return words;
    const bool is_quoted = text.front() == '"';
    if (is_quoted) text.remove_prefix(1);
    const std::size_t size =
        std::min(is_quoted ? text.find('"') : text.find_first_of(kBlanks), text.size());
    std::string word(text.substr(0, size));
    std::ranges::replace_if(
        word, [](char c) { return c == '\n' || c == '\r'; }, ' ');
    words.push_back(Quoted(word));
    text.remove_prefix(std::min(size + (is_quoted ? 1 : 0), text.size()));
  }
}

std::string ListText(const std::vector<std::string>& words, std::string_view brackets) {
  std::string text(1, brackets.front());
  for (const std::string& word : words) text += (text.size() > 1 ? ", " : "") + word;
  return text + brackets.back();
}

std::string ValueText(const std::vector<std::string>& words) {
  if (words.empty()) return "~";
  return words.size() == 1 ? words.front() : ListText(words, "[]");
}

std::string ValueText(const XmlKey& key) {
  std::vector<std::string> words = WordsOf(key.text);
  std::vector<std::string> pairs;
  for (const XmlKey& of_key : key.keys) {
    std::vector<std::string> of_words = WordsOf(of_key.text);
    if (of_key.name == "_") {  // a member of a list
      std::ranges::move(of_words, std::back_inserter(words));
    } else {
      pairs.push_back(Quoted(of_key.name) + ": " + ValueText(of_words));
    }
  }
  return pairs.empty() ? ValueText(words) : ListText(pairs, "{}");
}

}  // namespace

std::string OpencvXmlToYaml(const std::filesystem::path& path, const std::string& xml) {
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(
      XML_ParserCreate(nullptr), &XML_ParserFree);
  if (!parser) throw std::bad_alloc();
  XmlCollector collector{parser.get(), {}, 0, {}};
  XML_SetUserData(parser.get(), &collector);
  XML_SetElementHandler(parser.get(), OnXmlStart, OnXmlEnd);
  XML_SetCharacterDataHandler(parser.get(), OnXmlText);
  XML_SetStartDoctypeDeclHandler(parser.get(), OnXmlDocumentType);
  const bool is_whole =
      xml.size() <= INT_MAX &&
      XML_Parse(parser.get(), xml.data(), static_cast<int>(xml.size()), XML_TRUE) == XML_STATUS_OK;
  if (!is_whole || collector.root != "opencv_storage") {
    const char* reason =
        is_whole ? "another outermost element" : XML_ErrorString(XML_GetErrorCode(parser.get()));
    throw Error(
        ErrorParts{.what = std::string("camera calibration: not XML of cv::FileStorage: ") + reason,
                   .where = AtLine(path, XML_GetCurrentLineNumber(parser.get())),
                   .expected = {},
                   .found = {}});
  }
  std::string yaml;
  std::size_t line = 1;
  for (const XmlKey& key : collector.keys) {
    for (; line < key.line; ++line) yaml += '\n';
    yaml += Quoted(key.name) + ": " + ValueText(key) + "\n";
    ++line;
  }
  return yaml;
}

}  // namespace mono3d
