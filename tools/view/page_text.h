// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string_view>

namespace mono3d::tools {

// The files of view/page.
std::string_view ViewHtml();
std::string_view ViewCss();
std::string_view ViewMainJs();
std::string_view ViewSurfelsJs();
std::string_view ViewControlsJs();
std::string_view ViewFlightJs();
std::string_view ViewMeasureJs();
std::string_view ViewNextViewsJs();

}  // namespace mono3d::tools
