#include <gtest/gtest.h>

#include <sstream>

#include "help_formatter.h"
#include "man_page.h"

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

TEST(ManPage, HoldsOptionsCommandsAndExamplesThatRoffTakesAsTheyAre) {
    CLI::App app("Does things: many. And more.", "tool");
    app.formatter(std::make_shared<HelpFormatter>());
    bool flag = false;
    app.add_flag("--flag", flag, ".dot and back\\slash");
    CLI::App* const command = app.add_subcommand("command", "Does one thing.");
    std::string file;
    command->add_option("FILE", file, "A file")->required();
    command->add_flag("--hidden", flag, "not shown")->group("");
    command->footer("Example:\n  tool command 'a' --flag");
    const std::string page = manPage(app, "1.2");
    for (const char* part : {".TH TOOL 1 \"\" \"Variolux 1.2\"", "tool \\- Does things: many\n",
                             "\\fBtool command\\fR \\fIFILE\\fR [\\fIOPTIONS\\fR]", ".SS tool command",
                             "\\fB\\-\\-flag\\fR\n\\&.dot and back\\eslash\n",
                             ".nf\nExample:\n  tool command 'a' \\-\\-flag\n.fi\n"})
        EXPECT_NE(page.find(part), std::string::npos) << part << "\nin\n" << page;
    EXPECT_EQ(page.find("hidden"), std::string::npos);
}

}  // namespace
}  // namespace vlx
