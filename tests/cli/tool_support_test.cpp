#include <gtest/gtest.h>

#include <sstream>

#include "help_formatter.h"

namespace vlx {
namespace {

TEST(Wrapped, BreaksAtSpacesOnly) {
    EXPECT_EQ(wrapped("aa bb cc", 5), "aa bb\ncc");
    EXPECT_EQ(wrapped("aa bb cc", 4), "aa\nbb\ncc");
    EXPECT_EQ(wrapped("abcdefgh ij", 4), "abcdefgh\nij");
    EXPECT_EQ(wrapped("", 4), "");
}

TEST(Wrapped, ReflowsLinesAndKeepsParagraphs) {
    EXPECT_EQ(wrapped("a\nb", 80), "a b");
    EXPECT_EQ(wrapped("a b\n\nc", 80), "a b\n\nc");
    EXPECT_EQ(wrapped("\n\na\n\n\n\nb\n\n", 80), "a\n\nb");
}

TEST(HelpFormatter, SetsEverythingIn80ColumnsAndSaysDefaultsAndNeeds) {
    const std::string words =
        "one two three four five six seven eight nine ten eleven twelve thirteen "
        "fourteen fifteen sixteen seventeen";
    CLI::App app(words, "tool");
    app.formatter(std::make_shared<HelpFormatter>());
    int number = 7;
    app.add_option("--number", number, words)->capture_default_str();
    bool flag = false;
    app.add_flag("--flag", flag, "A flag")->needs("--number")->group("Other");
    app.add_subcommand("command", words);
    const std::string help = app.help();
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
    EXPECT_NE(help.find("(default: 7)"), std::string::npos) << help;
    EXPECT_NE(help.find("A flag (needs --number)"), std::string::npos) << help;
    EXPECT_EQ(help.find("\n\n\n"), std::string::npos) << help;
}

}  // namespace
}  // namespace vlx
