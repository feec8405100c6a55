#pragma once

#include <string_view>

namespace vlx {

// The sources of the report's page, embedded at build time by report/embed.cmake.
extern const std::string_view kPageHtml, kPageCss, kPageScript;

}  // namespace vlx
