// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/dji_xmp.h"

#include <expat.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <new>
#include <string_view>
#include <vector>

#include "io/text.h"

namespace mono3d {
namespace {

constexpr char kNamespaceEnd = '|';
constexpr std::string_view kDjiNamespace = "http://www.dji.com/drone-dji/1.0/|";

using DjiProperties = std::map<std::string, std::string, std::less<>>;

// Collects the properties of DJI's namespace. XMP writes a simple property as an attribute or as an
// element, as the writer likes.
struct DjiPropertyCollector {
  XML_Parser parser;
  DjiProperties properties;
  std::string* open = nullptr;  // value of the property whose element is open
};

void OnStartElement(void* user, const XML_Char* name, const XML_Char** attributes) {
  auto& collector = *static_cast<DjiPropertyCollector*>(user);
  const auto property = [&](std::string_view qualified) -> std::string* {
    if (!qualified.starts_with(kDjiNamespace)) return nullptr;
    qualified.remove_prefix(kDjiNamespace.size());
    return &collector.properties[std::string(qualified)];
  };
  for (; *attributes != nullptr; attributes += 2) {
    if (std::string* value = property(attributes[0])) *value = attributes[1];
  }
  collector.open = property(name);
}

void OnEndElement(void* user, const XML_Char* /*name*/) {
  static_cast<DjiPropertyCollector*>(user)->open = nullptr;
}

void OnText(void* user, const XML_Char* text, int length) {
  auto& collector = *static_cast<DjiPropertyCollector*>(user);
  if (collector.open != nullptr) {
    collector.open->append(text, static_cast<std::size_t>(length));
  }
}

// XMP has no document type; its entities could make a small packet large.
void OnDocumentType(void* user, const XML_Char* /*name*/, const XML_Char* /*system_id*/,
                    const XML_Char* /*public_id*/, int /*has_internal_subset*/) {
  XML_StopParser(static_cast<DjiPropertyCollector*>(user)->parser, XML_FALSE);
}

std::optional<DjiProperties> ReadDjiProperties(std::string_view packet) {
  // Writers fill up packets with blanks, some with zeros.
  const std::size_t begin = packet.find('<');
  const std::size_t end = packet.rfind('>');
  if (begin == std::string_view::npos || end == std::string_view::npos || end < begin) {
    return std::nullopt;
  }
  packet = packet.substr(begin, end - begin + 1);
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(
      XML_ParserCreateNS(nullptr, kNamespaceEnd), &XML_ParserFree);
  if (!parser) throw std::bad_alloc();
  DjiPropertyCollector collector{parser.get(), {}, nullptr};
  XML_SetUserData(parser.get(), &collector);
  XML_SetElementHandler(parser.get(), OnStartElement, OnEndElement);
  XML_SetCharacterDataHandler(parser.get(), OnText);
  XML_SetStartDoctypeDeclHandler(parser.get(), OnDocumentType);
  const int size = static_cast<int>(packet.size());  // a JPEG segment, or a tag of 4 GB at most
  if (size < 0 || XML_Parse(parser.get(), packet.data(), size, XML_TRUE) != XML_STATUS_OK) {
    return std::nullopt;
  }
  return collector.properties;
}

std::string_view Trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

std::string_view DjiText(const DjiProperties& properties, std::string_view name) {
  const auto found = properties.find(name);
  return found == properties.end() ? std::string_view{} : Trimmed(found->second);
}

// Focal lengths and coordinates are positive and below this many pixels, or not used.
double DjiPixels(const DjiProperties& properties, std::string_view name) {
  constexpr double kMax_px = 1e6;
  const double number = ParseNumber(DjiText(properties, name)).value_or(0);
  return number > 0 && number < kMax_px ? number : 0;
}

bool IsPlausible(const DjiDewarpData& data) {
  constexpr double kMaxAspect = 1.1;    // pixels are all but square
  constexpr double kMaxOffset = 0.2;    // of the focal length
  constexpr double kMaxDistortion = 3;  // k1, k2, k3 of action cameras are below 1
  constexpr double kMaxTangential = 0.1;
  const auto& k = data.distortion;
  return data.fx > 0 && data.fy > 0 && data.fx < kMaxAspect * data.fy &&
         data.fy < kMaxAspect * data.fx && std::abs(data.offset_x) < kMaxOffset * data.fx &&
         std::abs(data.offset_y) < kMaxOffset * data.fy && std::abs(k[0]) < kMaxDistortion &&
         std::abs(k[1]) < kMaxDistortion && std::abs(k[4]) < kMaxDistortion &&
         std::abs(k[2]) < kMaxTangential && std::abs(k[3]) < kMaxTangential;
}

// "2018-09-04;fx,fy,cx,cy,k1,k2,p1,p2,k3"
std::optional<DjiDewarpData> ParseDewarpData(std::string_view text) {
  DjiDewarpData data;
  const std::size_t semicolon = text.find(';');
  if (semicolon != std::string_view::npos) {
    data.date = Trimmed(text.substr(0, semicolon));
    text.remove_prefix(semicolon + 1);
  }
  std::vector<double> numbers;
  while (true) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::optional<double> number = ParseNumber(Trimmed(text.substr(0, comma)));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
    if (comma == text.size()) break;
    text.remove_prefix(comma + 1);
  }
  if (numbers.size() != 9) return std::nullopt;
  data.fx = numbers[0];
  data.fy = numbers[1];
  data.offset_x = numbers[2];
  data.offset_y = numbers[3];
  std::copy(numbers.begin() + 4, numbers.end(), data.distortion.begin());
  if (!IsPlausible(data)) return std::nullopt;
  return data;
}

int DecimalsBehindPoint(std::string_view number) {
  const std::size_t point = number.find('.');
  return point == std::string_view::npos ? 0 : static_cast<int>(number.size() - point - 1);
}

DjiXmpPosition ParseDjiPosition(const DjiProperties& properties) {
  const auto number = [&](std::string_view name) { return ParseNumber(DjiText(properties, name)); };
  const auto sigma = [&](std::string_view name) { return std::max(0.0, number(name).value_or(0)); };
  // Both spellings are theirs.
  const std::string_view longitude_name =
      properties.contains("GpsLongitude") ? "GpsLongitude" : "GpsLongtitude";
  DjiXmpPosition position;
  position.latitude_deg = number("GpsLatitude");
  position.longitude_deg = number(longitude_name);
  position.num_decimals = std::max(DecimalsBehindPoint(DjiText(properties, "GpsLatitude")),
                                   DecimalsBehindPoint(DjiText(properties, longitude_name)));
  position.altitude_m = number("AbsoluteAltitude");
  position.height_m = number("RelativeAltitude");
  position.sigma_latitude_m = sigma("RtkStdLat");
  position.sigma_longitude_m = sigma("RtkStdLon");
  position.sigma_height_m = sigma("RtkStdHgt");
  position.gimbal_yaw_deg = number("GimbalYawDegree");
  position.gimbal_pitch_deg = number("GimbalPitchDegree");
  position.gimbal_roll_deg = number("GimbalRollDegree");
  return position;
}

}  // namespace

std::optional<DjiXmp> ParseDjiXmp(const std::string& packet) {
  const std::optional<DjiProperties> properties = ReadDjiProperties(packet);
  if (!properties) return std::nullopt;
  DjiXmp xmp;
  xmp.serial = DjiText(*properties, "CameraSerialNumber");
  xmp.design_focal_px = DjiPixels(*properties, "CalibratedFocalLength");
  xmp.design_centre_x = DjiPixels(*properties, "CalibratedOpticalCenterX");
  xmp.design_centre_y = DjiPixels(*properties, "CalibratedOpticalCenterY");
  const std::string_view dewarp = DjiText(*properties, "DewarpData");
  xmp.dewarp = ParseDewarpData(dewarp);
  xmp.position = ParseDjiPosition(*properties);
  xmp.is_dewarped = DjiText(*properties, "DewarpFlag") == "1";
  xmp.has_absurd_value =
      (!dewarp.empty() && !xmp.dewarp) ||
      (!DjiText(*properties, "CalibratedFocalLength").empty() && xmp.design_focal_px == 0);
  return xmp;
}

}  // namespace mono3d
