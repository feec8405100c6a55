#include <gtest/gtest.h>

#include <sstream>

#include "frames.h"
#include "help_formatter.h"
#include "man_page.h"
#include "tool_main.h"

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

TEST(FiniteNumbers, AreAllThatPasses) {
    for (const char* text : {"nan", "-nan", "inf", "-inf", "1e999", "", "x", "1x"})
        for (const CLI::Validator& check : {finiteWithin(-9, 9), finitePositive(), finiteNonNegative()}) {
            const std::string fault = check(text);
            EXPECT_NE(fault.find(std::string("found '") + text + "'"), std::string::npos) << text << fault;
        }
    EXPECT_EQ(finiteWithin(-9, 9)("9"), "");
    EXPECT_EQ(finiteWithin(-9, 9)("9.1"), "expected a number of -9 to 9, found '9.1'");
    EXPECT_EQ(finitePositive()("1e-320"), "");
    EXPECT_NE(finitePositive()("0"), "");
    EXPECT_EQ(finiteNonNegative()("0"), "");
    EXPECT_NE(finiteNonNegative()("-1e-9"), "");
}

TEST(ParseFrames, ListsRangesAndSteps) {
    EXPECT_EQ(parseFrames("7"), std::vector<int>({7}));
    EXPECT_EQ(parseFrames("1-3,7,10-20x5"), std::vector<int>({1, 2, 3, 7, 10, 15, 20}));
    EXPECT_EQ(parseFrames("1-6x2"), std::vector<int>({1, 3, 5}));
    EXPECT_EQ(parseFrames("5,1-6x4"), std::vector<int>({5, 1})) << "each once, in this order";
    for (const char* text :
         {"", ",", "1,", "a", "1-", "-1", "3-1", "1-3x0", "1-3x", "1x2", "1-3 ", "99999999999", "0-2000000"})
        EXPECT_THROW(parseFrames(text), CLI::ValidationError) << text;
}

TEST(ParseBand, CountsFromOne) {
    const Band band = parseBand("2/5");
    EXPECT_EQ(band.index, 1);
    EXPECT_EQ(band.count, 5);
    for (const char* text : {"0/2", "3/2", "1", "1/2x", "a/b", "-1/2", "1/", "/2"})
        EXPECT_THROW(parseBand(text), CLI::ValidationError) << text;
}

TEST(FrameName, PutsTheNumberInPlaceOfEachRun) {
    EXPECT_EQ(frameName("a_####.exr", 12), "a_0012.exr");
    EXPECT_EQ(frameName("a_##.exr", 123), "a_123.exr");
    EXPECT_EQ(frameName("x#/a#b##.exr", 5), "x#/a5b05.exr") << "folders stay";
    EXPECT_EQ(frameName("a.exr", 5), "a.exr");
}

TEST(BandOf, CutsAllRowsInOrder) {
    for (const int height : {1, 7, 64, 2160})
        for (const int count : {1, 2, 3, 7}) {
            int next = -3;
            for (int i = 0; i < count; ++i) {
                const Window band = bandOf({5, -3, 9, height}, {i, count});
                EXPECT_EQ(band.y, next);
                EXPECT_NEAR(band.height, static_cast<double>(height) / count, 1);
                next += band.height;
            }
            EXPECT_EQ(next, -3 + height);
        }
}

}  // namespace
}  // namespace vlx
