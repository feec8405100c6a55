#include "progress_bar.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

namespace vlx {
namespace {

TEST(ProgressLine, SaysHowFarAndHowLong) {
    EXPECT_EQ(progressLine("tracing", 0, 0, 200), "tracing  [" + std::string(40, '.') + "]   0 %");
    EXPECT_EQ(progressLine("tracing", 0.25, 30, 200),
              "tracing  [" + std::string(10, '#') + std::string(30, '.') + "]  25 %, 1 min 30 s left");
    EXPECT_EQ(progressLine("tracing", 1, 30, 200), "tracing  [" + std::string(40, '#') + "] 100 %");
}

TEST(ProgressLine, FitsIntoAnyWidth) {
    for (int columns = 0; columns < 120; ++columns)
        for (const double fraction : {-1.0, 0.0, 0.3, 1.0, 7.0})
            EXPECT_LE(progressLine("a label", fraction, 5000, columns).size(),
                      static_cast<std::size_t>(columns));
}

TEST(DurationText, UsesTheUnitsThatMatter) {
    EXPECT_EQ(durationText(-1), "0 s");
    EXPECT_EQ(durationText(0.2), "1 s");
    EXPECT_EQ(durationText(59.5), "1 min 00 s");
    EXPECT_EQ(durationText(185), "3 min 05 s");
    EXPECT_EQ(durationText(2 * 3600 + 7 * 60 + 3), "2 h 07 min");
    EXPECT_EQ(durationText(1e300), "very long");
}

TEST(ProgressBar, IsSilentWhereNobodyLooks) {
    std::FILE* file = std::tmpfile();
    {
        ProgressBar bar("label", file);
        EXPECT_FALSE(Progress(bar));
    }
    std::fseek(file, 0, SEEK_END);
    EXPECT_EQ(std::ftell(file), 0);
    std::fclose(file);
}

TEST(ProgressBar, DrawsOnATerminalAndCleansUp) {
    const int outer = ::posix_openpt(O_RDWR | O_NOCTTY);
    if (outer < 0 || ::grantpt(outer) != 0 || ::unlockpt(outer) != 0)
        GTEST_SKIP() << "no pseudo-terminals here";
    std::FILE* terminal = std::fopen(::ptsname(outer), "w");
    ASSERT_NE(terminal, nullptr);
    {
        ProgressBar bar("label", terminal);
        const Progress progress = bar;
        ASSERT_TRUE(progress);
        std::vector<std::thread> threads;
        for (int t = 0; t < 4; ++t)
            threads.emplace_back([&, t] {
                for (int i = 1; i <= 100; ++i) progress(i * 4 - t, 400);
            });
        for (auto& thread : threads) thread.join();
        progress(1, 0);  // a total of nothing is no reason to divide by it
    }
    std::fclose(terminal);
    std::string drawn;
    std::array<char, 4096> text{};
    for (ssize_t count; (count = ::read(outer, text.data(), text.size())) > 0;)
        drawn.append(text.data(), static_cast<std::size_t>(count));
    ::close(outer);
    EXPECT_TRUE(drawn.starts_with("\rlabel  [")) << drawn;
    EXPECT_NE(drawn.find(" %"), std::string::npos);
    EXPECT_TRUE(drawn.ends_with("\r\033[K")) << "the line is erased in the end";
}

TEST(ProgressRecord, IsALineOfJson) {
    EXPECT_EQ(progressRecord(LogFormat::Json, "kriging", 0.25, 10, 210.4),
              "{\"event\":\"progress\",\"task\":\"kriging\",\"fraction\":0.25,\"seconds\":10.0,"
              "\"secondsLeft\":30.0,\"peakMemoryMB\":210.0}\n");
    EXPECT_NE(progressRecord(LogFormat::Json, "a", 0, 0, 1).find("\"secondsLeft\":null"), std::string::npos);
    EXPECT_NE(progressRecord(LogFormat::Json, "a", 1, 0, 1).find("\"secondsLeft\":0.0"), std::string::npos);
}

TEST(ProgressRecord, IsWhatOpenJobDescriptionReads) {
    EXPECT_EQ(progressRecord(LogFormat::OpenJd, "kriging", 0.256, 10, 210),
              "openjd_status: kriging\nopenjd_progress: 25.6\n");
    EXPECT_EQ(progressRecord(LogFormat::OpenJd, "kriging", 7, 10, 210),
              "openjd_status: kriging\nopenjd_progress: 100.0\n");
}

TEST(ProgressBar, WritesFirstAndLastRecordsForPrograms) {
    std::FILE* file = std::tmpfile();
    setLogFormat(LogFormat::Json);
    {
        ProgressBar bar("label", file);
        const Progress progress = bar;
        ASSERT_TRUE(progress);
        for (int i = 1; i <= 100; ++i) progress(i, 100);
    }
    setLogFormat(LogFormat::Text);
    std::string written(4096, '\0');
    std::rewind(file);
    written.resize(std::fread(written.data(), 1, written.size(), file));
    std::fclose(file);
    EXPECT_NE(written.find("\"fraction\":0.01,"), std::string::npos) << written;
    EXPECT_NE(written.find("\"fraction\":1.0,"), std::string::npos) << written;
    EXPECT_EQ(std::count(written.begin(), written.end(), '\n'), 2) << written;
}

}  // namespace
}  // namespace vlx
