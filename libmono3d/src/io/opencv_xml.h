// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>

namespace mono3d {

// The XML of cv::FileStorage, read without it, as it reads outside of its memory where XML is not
// whole. The same as YAML: keys with words, lists of words, or such keys of their own, each on the
// line that it has in the XML. What lies deeper is left out. Throws Error, which names the path and
// the line, on anything but a whole file as cv::FileStorage writes it.
std::string OpencvXmlToYaml(const std::filesystem::path& path, const std::string& xml);

}  // namespace mono3d
