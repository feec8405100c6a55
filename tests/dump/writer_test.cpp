#include "variolux/dump/writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>

#include "../base/temporary_folder.h"
#include "test_dumps.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

const CountOf kThree = [](int, int) { return 3; };

// While it lives, no file of this process may grow past a size: a full disk that needs no rights.
class FullDisk {
  public:
    explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        rlimit limit = before_;
        limit.rlim_cur = bytes;
        ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FullDisk() {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    FullDisk(const FullDisk&) = delete;
    FullDisk& operator=(const FullDisk&) = delete;

  private:
    rlimit before_{};
    void (*handler_)(int);
};

TEST(DumpWriter, FullDiskIsAnErrorThatLeavesNothing) {
    const TemporaryFolder folder;
    const TestDump dump = makeDump({0, 0, 60, 80}, standardChannels(), kThree);
    writeDump(folder / "whole.exr", dump);
    const auto whole = static_cast<rlim_t>(std::filesystem::file_size(folder / "whole.exr"));
    std::filesystem::remove(folder / "whole.exr");
    // In the header, in the first band, in a later one, in the last bytes.
    for (const rlim_t size : {rlim_t{0}, rlim_t{200}, rlim_t{5000}, whole / 2, whole - 1}) {
        std::string message;
        {
            const FullDisk full(size);
            message = errorOf([&] { writeDump(folder / "a.exr", dump, 4); });
        }
        EXPECT_NE(message.find("a.exr: writing failed: File too large"), std::string::npos) << message;
        EXPECT_EQ(folder.entries(), 0) << "at " << size << " of " << whole << " bytes";
    }
}

TEST(DumpWriter, KeepsTheOldFileWhenItFails) {
    const TemporaryFolder folder;
    const TestDump dump = makeDump({0, 0, 30, 30}, standardChannels(), kThree);
    writeDump(folder / "a.exr", dump);
    const auto before = fileBytes(folder / "a.exr");
    {
        const FullDisk full(3000);
        errorOf([&] { writeDump(folder / "a.exr", dump); });
    }
    EXPECT_EQ(fileBytes(folder / "a.exr"), before);
    EXPECT_EQ(folder.entries(), 1);
}

TEST(DumpWriter, UnfinishedLeavesNothing) {
    const TemporaryFolder folder;
    const TestDump dump = makeDump({0, 0, 8, 8}, standardChannels(), kThree);
    {
        DumpWriter writer(folder / "a.exr", dump.header);
        writer.write(rowsOf(dump.all, 0, 4));
    }
    EXPECT_EQ(folder.entries(), 0);
    {
        DumpWriter writer(folder / "a.exr", dump.header);
        writer.write(rowsOf(dump.all, 0, 4));
        const std::string message = errorOf([&] { writer.close(); });
        EXPECT_NE(message.find("row 4"), std::string::npos) << message;
    }
    EXPECT_EQ(folder.entries(), 0);
}

TEST(DumpWriter, ClosesOnce) {
    const TemporaryFolder folder;
    const TestDump dump = makeDump({0, 0, 2, 2}, standardChannels(), kThree);
    DumpWriter writer(folder / "a.exr", dump.header);
    writer.write(dump.all);
    writer.close();
    EXPECT_NE(errorOf([&] { writer.close(); }).find("closed already"), std::string::npos);
    EXPECT_EQ(folder.entries(), 1);
}

TEST(DumpWriter, RefusesBandsThatDoNotFit) {
    const TemporaryFolder folder;
    const TestDump dump = makeDump({5, 5, 8, 8}, standardChannels(), kThree);
    DumpWriter writer(folder / "a.exr", dump.header);
    writer.write(rowsOf(dump.all, 0, 2));
    const auto refused = [&](const char* why, const std::function<void(SampleBand&)>& spoil) {
        SampleBand band = rowsOf(dump.all, 2, 2);
        spoil(band);
        EXPECT_NE(errorOf([&] { writer.write(band); }), "") << why;
    };
    refused("a gap", [](SampleBand& band) { band.y += 1; });
    refused("rows again", [](SampleBand& band) { band.y -= 1; });
    refused("other columns", [](SampleBand& band) { band.x = 0; });
    refused("too narrow", [](SampleBand& band) { band.width -= 1; });
    refused("too many rows", [](SampleBand& band) { band.height = 7; });
    refused("no rows", [](SampleBand& band) { band.height = 0; });
    refused("too few offsets", [](SampleBand& band) { band.offsets.pop_back(); });
    refused("decreasing offsets", [](SampleBand& band) { std::swap(band.offsets[3], band.offsets[4]); });
    refused("offsets not from 0", [](SampleBand& band) { band.offsets[0] = 1; });
    refused("no offsets", [](SampleBand& band) { band.offsets.clear(); });
    refused("a value too few", [](SampleBand& band) { band.values[2].pop_back(); });
    refused("a channel too few", [](SampleBand& band) {
        band.values.pop_back();
        band.channels.pop_back();
    });
    refused("channels in another order",
            [](SampleBand& band) { std::swap(band.channels[0], band.channels[1]); });
    // The writer goes on as if nothing had been: what follows fits.
    writer.write(rowsOf(dump.all, 2, 6));
    writer.close();
    expectSame(dump.all, DumpReader(folder / "a.exr").read(5, 8, dump.all.channels));
}

TEST(DumpWriter, RefusesHeadersThatCannotBeWritten) {
    const TemporaryFolder folder;
    const auto refused = [&](const char* why, const std::function<void(DumpHeader&)>& spoil) {
        DumpHeader header = makeDump({0, 0, 4, 4}, standardChannels(), kThree).header;
        spoil(header);
        EXPECT_NE(errorOf([&] { DumpWriter(folder / "a.exr", header); }).find("a.exr"), std::string::npos)
            << why;
        EXPECT_EQ(folder.entries(), 0) << why;
    };
    refused("empty window", [](DumpHeader& header) { header.data.width = 0; });
    refused("empty display window", [](DumpHeader& header) { header.display.height = -1; });
    refused("coordinates too large", [](DumpHeader& header) { header.data.x = 2147483647; });
    refused("a name twice", [](DumpHeader& header) { header.channels.push_back(header.channels[0]); });
    refused("an empty name", [](DumpHeader& header) { header.channels[4].name.clear(); });
    refused("a long name", [](DumpHeader& header) { header.channels[4].name = std::string(256, 'x'); });
    refused("no radiance", [](DumpHeader& header) { header.channels.erase(header.channels.begin() + 1); });
    refused("a matrix of 15", [](DumpHeader& header) { header.worldToNDC = std::vector<float>(15); });
    refused("a comma", [](DumpHeader& header) { header.effects = {"a,b"}; });
    refused("a reserved attribute", [](DumpHeader& header) { header.extra["chunkCount"] = "3"; });
    const DumpHeader fine = makeDump({0, 0, 4, 4}, standardChannels(), kThree).header;
    EXPECT_NE(errorOf([&] { DumpWriter(folder / "no/a.exr", fine); }).find("no/a.exr"), std::string::npos);
}

TEST(DumpWriter, TellsItsProcessorTime) {
    const TemporaryFolder folder;
    const TestDump dump = makeDump({0, 0, 100, 100}, standardChannels(), kThree);
    DumpWriter writer(folder / "a.exr", dump.header);
    EXPECT_EQ(writer.cpuSeconds(), 0);
    writer.write(dump.all);
    writer.close();
    EXPECT_GT(writer.cpuSeconds(), 0);
    EXPECT_LT(writer.cpuSeconds(), 60);
}

}  // namespace
}  // namespace vlx
