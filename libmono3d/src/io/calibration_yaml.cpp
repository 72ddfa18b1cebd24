// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/calibration_yaml.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <sstream>

#include "io/opencv_xml.h"
#include "io/text.h"

namespace mono3d {
namespace {

std::string LowerCase(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// Calibrations have a few thousand. The parser takes time with the square of what follows a
// bracket that is not closed.
constexpr std::size_t kMaxYamlBytes = 100'000;

// A calibration is one document; files of several cameras have one of each.
constexpr int kMaxYamlDocuments = 16;

// YAML::LoadAll of yaml-cpp before 0.9 adds an empty document again and again, without end, where a
// document begins with a comma or a closing bracket (https://github.com/jbeder/yaml-cpp/pull/1319).
class DocumentCount : public YAML::EventHandler {
 public:
  // Throws YAML::ParserException where there are too many.
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++count_ > kMaxYamlDocuments) {
      throw YAML::ParserException(mark, "more than " + std::to_string(kMaxYamlDocuments) +
                                            " documents, or a bracket or comma too many");
    }
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

 private:
  int count_ = 0;
};

void RequireFewDocuments(const std::string& yaml) {
  std::istringstream stream(yaml);
  YAML::Parser parser(stream);
  DocumentCount count;
  while (parser.HandleNextDocument(count)) {
  }
}

// A transforms.json has the poses of all images behind the camera.
std::string WithoutFrames(const std::string& json) {
  const std::size_t frames = json.find("\"frames\"");
  return frames == std::string::npos ? json : json.substr(0, frames) + "}";
}

}  // namespace

CalibrationYaml::CalibrationYaml(const std::filesystem::path& path) : path_(path) {
  std::string text = ReadBytes(path);
  if (text.size() > kMaxYamlBytes && text.starts_with('{')) text = WithoutFrames(text);
  if (text.size() > kMaxYamlBytes) {
    Throw(path_, "the file is too large for a calibration",
          "at most " + std::to_string(kMaxYamlBytes) + " bytes", std::to_string(text.size()));
  }
  try {
    if (text.starts_with("<?xml")) text = OpencvXmlToYaml(path_, text);
    RequireFewDocuments(text);
    // Header "%YAML:1.0" and tags "!!opencv-matrix" of OpenCV are a directive and a type that
    // YAML does not know, which are to be passed over.
    for (const YAML::Node& document : YAML::LoadAll(text)) AddKeys(document, "");
  } catch (const YAML::Exception& error) {
    Throw(LineAt(error.mark), "not YAML: " + error.msg, {}, {});
  }
}

std::string CalibrationYaml::FirstOf(const std::vector<std::string>& names) const {
  const auto found = std::ranges::find_if(names, [&](const auto& name) { return Has(name); });
  return found == names.end() ? names.back() : *found;
}

int CalibrationYaml::Size(const std::string& key) const {
  const std::vector<double> numbers = Numbers(key, Require(key).value);
  if (numbers.size() != 1 || numbers[0] < 1 || numbers[0] > 1e6 ||
      numbers[0] != std::floor(numbers[0])) {
    Throw(Line(key), "bad " + key, "one positive whole number", Text(keys_.at(key).value));
  }
  return static_cast<int>(numbers[0]);
}

std::vector<double> CalibrationYaml::Matrix(const std::string& key) const {
  Require(key);
  const std::string data = keys_.contains(key + ".data") ? key + ".data" : key;
  const std::vector<double> numbers = Numbers(key, keys_.at(data).value);
  for (const char* part : {".rows", ".cols"}) {
    if (!keys_.contains(key + part)) return numbers;
  }
  const std::int64_t num_numbers =
      std::int64_t{Size(key + ".rows")} * std::int64_t{Size(key + ".cols")};
  if (num_numbers != static_cast<std::int64_t>(numbers.size())) {
    Throw(Line(data), "wrong number of values in " + key, std::to_string(num_numbers),
          std::to_string(numbers.size()));
  }
  return numbers;
}

double CalibrationYaml::Number(const std::string& key) const {
  Require(key);
  return *FindNumber(key);
}

std::optional<double> CalibrationYaml::FindNumber(const std::string& key) const {
  if (!keys_.contains(key)) return std::nullopt;
  const std::vector<double> numbers = Numbers(key, Require(key).value);
  if (numbers.size() != 1) {
    Throw(Line(key), "bad " + key, "one number", Text(keys_.at(key).value));
  }
  return numbers[0];
}

std::optional<std::string> CalibrationYaml::Find(const std::string& key) const {
  if (!keys_.contains(key)) return std::nullopt;
  return Text(keys_.at(key).value);
}

void CalibrationYaml::Throw(const std::string& where, const std::string& what,
                            const std::string& expected, const std::string& found, ErrorCode code) {
  throw Error(ErrorParts{.what = "camera calibration: " + what,
                         .where = where,
                         .expected = expected,
                         .found = found,
                         .code = code});
}

void CalibrationYaml::AddKeys(const YAML::Node& map, const std::string& prefix) {
  if (!map.IsMap()) return;
  for (const auto& pair : map) {
    if (!pair.first.IsScalar()) continue;
    const std::string name = prefix + LowerCase(pair.first.Scalar());
    Key& key = keys_[name];
    key.mark = pair.first.Mark();
    ++key.num_times;
    key.value.reset(pair.second);  // = would change the document itself
    if (prefix.empty()) AddKeys(pair.second, name + ".");
  }
}

const CalibrationYaml::Key& CalibrationYaml::Require(const std::string& key) const {
  const auto found = keys_.find(key);
  if (found == keys_.end()) Throw(path_, "key is missing", key, {});
  const int num_times = found->second.num_times;
  if (num_times > 1) {
    Throw(Line(key), "several cameras in one file", key + " once", std::to_string(num_times));
  }
  return found->second;
}

std::string CalibrationYaml::LineAt(const YAML::Mark& mark) const {
  return AtLine(path_, static_cast<std::size_t>(mark.line) + 1);
}

std::string CalibrationYaml::Text(const YAML::Node& value) {
  if (value.IsMap()) return "keys and values";
  if (value.IsSequence()) return "a list";
  return value.Scalar().empty() ? "nothing" : value.Scalar();
}

// Of a scalar, or of a list of such; none of any other value.
std::vector<double> CalibrationYaml::Numbers(const std::string& key,
                                             const YAML::Node& value) const {
  std::vector<double> numbers;
  const auto add = [&](const YAML::Node& item) {
    const std::optional<double> number =
        item.IsScalar() ? ParseNumber(item.Scalar()) : std::nullopt;
    if (!number) Throw(LineAt(item.Mark()), "bad value in " + key, "a finite number", Text(item));
    numbers.push_back(*number);
  };
  if (value.IsScalar()) add(value);
  if (value.IsSequence()) std::ranges::for_each(value, add);
  return numbers;
}

}  // namespace mono3d
