#include "variolux/base/text.h"

#include <gtest/gtest.h>

#include "variolux/base/luminance.h"

namespace vlx {
namespace {

using Texts = std::vector<std::string>;

TEST(Text, ListsAndSplits) {
    EXPECT_EQ(listed({}), "");
    EXPECT_EQ(listed({"a", "", "c"}), "a, , c");
    EXPECT_EQ(split("a,,c", ','), (Texts{"a", "", "c"}));
    EXPECT_EQ(split("a,", ','), (Texts{"a", ""}));
    EXPECT_EQ(split("", ','), Texts{""});
    for (const Texts& parts : {Texts{""}, Texts{"R"}, Texts{"R", "", "B", ""}})
        EXPECT_EQ(split(listed(parts, "|"), '|'), parts);
}

TEST(Text, PrintableHasNothingThatATerminalObeys) {
    EXPECT_EQ(printable("a\x1b[2J\x7f\n\t\xc3\xa4"), "a?[2J???\xc3\xa4");
    EXPECT_EQ(printable("a\nb\tc", "\n"), "a\nb?c");
}

TEST(Text, HexHasSixteenDigits) {
    EXPECT_EQ(hexText(0), "0000000000000000");
    EXPECT_EQ(hexText(0xfedcba9876543210u), "fedcba9876543210");
}

TEST(Luminance, WhiteIsOne) {
    EXPECT_DOUBLE_EQ(luminance(1.0, 1.0, 1.0), 1);
    EXPECT_FLOAT_EQ(luminance(0.f, 2.f, 0.f), 2 * 0.7152f);
}

}  // namespace
}  // namespace vlx
