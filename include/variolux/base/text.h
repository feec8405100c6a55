#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// What messages and reports are made of.
namespace vlx {

/// "a, b, c".
std::string listed(const std::vector<std::string>& names, std::string_view separator = ", ");

/// What stands between separators, empty parts too: one empty part of an empty text.
std::vector<std::string> split(std::string_view text, char separator);

/// Names and headers out of files may hold what a terminal would obey: control characters but those in `kept`
/// become '?'.
std::string printable(std::string text, std::string_view kept = {});

/// One number by a format of printf; at most 63 characters.
std::string formatted(const char* format, double value);

/// Rows of cells; the first cell of a row is flush left, the others flush right.
std::string aligned(const std::vector<std::vector<std::string>>& rows);

/// 16 hexadecimal digits.
std::string hexText(std::uint64_t value);

}  // namespace vlx
