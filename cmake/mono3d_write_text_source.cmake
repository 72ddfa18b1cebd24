# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Writes SOURCE, a C++ file with a function FUNCTION that returns the text of the file TEXT.
file(READ "${TEXT}" text)
string(FIND "${text}" ")mono3d_text\"" end)
if(NOT end EQUAL -1)
  message(FATAL_ERROR "${TEXT} holds what would end its literal")
endif()
file(WRITE "${SOURCE}" "#include <string_view>
#pragma GCC diagnostic ignored \"-Woverlength-strings\"
namespace mono3d::tools {
std::string_view ${FUNCTION}();
std::string_view ${FUNCTION}() {
  using std::literals::operator\"\"sv;
  return R\"mono3d_text(")
file(APPEND "${SOURCE}" "${text}")
file(APPEND "${SOURCE}" ")mono3d_text\"sv;
}
}  // namespace mono3d::tools
")
