// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/live_address.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <string_view>

#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/io/live_input.h"

namespace mono3d {
namespace {

constexpr std::string_view kDevicePrefix = "/dev/video";
constexpr std::string_view kSchemeEnd = "://";

std::optional<LiveKind> KindOfLive(std::string_view input) {
  if (input.starts_with("rtsp://") || input.starts_with("rtsps://")) return LiveKind::kRtsp;
  if (input.starts_with("udp://") || input.starts_with("tcp://")) return LiveKind::kMpegTs;
  if (!input.starts_with(kDevicePrefix)) return std::nullopt;
  input.remove_prefix(kDevicePrefix.size());
  const bool is_number = !input.empty() && input.size() <= 3 &&
                         std::ranges::all_of(input, [](char c) { return c >= '0' && c <= '9'; });
  return is_number ? std::optional(LiveKind::kDevice) : std::nullopt;
}

// "10.0.0.1:554" of "rtsp://user:password@10.0.0.1:554/live".
std::string_view HostAndPort(std::string_view url) {
  url.remove_prefix(url.find(kSchemeEnd) + kSchemeEnd.size());
  url = url.substr(0, url.find_first_of("/?#"));
  return url.substr(url.rfind('@') + 1);  // of none: all
}

bool HasPort(std::string_view host_and_port) {
  const std::size_t colon = host_and_port.rfind(':');
  if (colon == std::string_view::npos) return false;
  const std::optional<std::int64_t> port =
      ParseInteger(std::string(host_and_port.substr(colon + 1)));
  return port && *port >= 1 && *port <= 65535;
}

// Some cameras have the password in the path: /user=admin_password=tlJwpbo6_channel=1.
std::size_t FindSecretInPath(std::string_view path) {
  constexpr std::array<std::string_view, 4> kSigns = {"user=", "pass", "pwd", "token"};
  std::string lower(path);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::size_t first = std::string::npos;
  for (const std::string_view sign : kSigns) first = std::min(first, lower.find(sign));
  return first;
}

}  // namespace

bool IsLiveInput(const std::string& input) { return KindOfLive(input).has_value(); }

std::string WithoutPassword(const std::string& input) {
  const std::size_t scheme_end = input.find(kSchemeEnd);
  if (scheme_end == std::string::npos) return input;
  const std::size_t start = scheme_end + kSchemeEnd.size();
  std::string rest = input.substr(start);
  // The last one: passwords with @ or / in them are written as they are now and then.
  if (const std::size_t at = rest.rfind('@'); at != std::string::npos) rest.erase(0, at + 1);
  rest = rest.substr(0, rest.find_first_of("?#"));
  if (const std::size_t secret = FindSecretInPath(rest); secret != std::string::npos) {
    rest = rest.substr(0, secret) + "...";
  }
  return input.substr(0, start) + rest;
}

LiveAddress ParseLiveAddress(const std::string& input) {
  const std::string shown = WithoutPassword(input);
  const std::optional<LiveKind> kind = KindOfLive(input);
  if (!kind) {
    throw UsageError(
        ErrorParts{.what = "no address of a live input",
                   .where = shown,
                   .expected = "rtsp://, rtsps://, udp://, tcp:// or /dev/video and a number",
                   .found = {}});
  }
  if (*kind == LiveKind::kDevice) return {*kind, input, shown, input.substr(5)};
  const bool is_printable =
      std::ranges::all_of(input, [](unsigned char c) { return std::isgraph(c) != 0; });
  const std::string_view host_and_port = HostAndPort(input);
  const bool is_whole = *kind == LiveKind::kRtsp ? !host_and_port.empty() : HasPort(host_and_port);
  if (!is_printable || !is_whole) {
    throw UsageError(ErrorParts{.what = "the address cannot be understood",
                                .where = shown,
                                .expected = *kind == LiveKind::kRtsp
                                                ? "rtsp://HOST/PATH or rtsp://HOST:PORT/PATH"
                                                : "udp://HOST:PORT or tcp://HOST:PORT",
                                .found = {}});
  }
  return {*kind, input, shown, "live"};
}

}  // namespace mono3d
