#include "test_dumps.h"

#include <Imath/half.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>

#include "variolux/base/error.h"
#include "variolux/dump/writer.h"

namespace vlx {

std::vector<DumpChannel> mixedChannels() {
    using enum ChannelType;
    return {{"R", Float},      {"G", Float},  {"B", Float},        {"A", Half},
            {"Z", Float},      {"N.X", Half}, {"sample.x", Float}, {"sample.replicate", Uint},
            {"albedo.R", Half}};
}

namespace {

float exactValue(ChannelType type, std::uint32_t bits, float smooth) {
    const bool special = bits % 31 == 0;
    switch (type) {
        case ChannelType::Uint:
            return static_cast<float>(bits % (1u << 24));
        case ChannelType::Half:
            return imath_half_to_float(special ? static_cast<std::uint16_t>(bits >> 8)
                                               : imath_float_to_half(smooth));
        default:
            return special ? std::bit_cast<float>(bits * 2654435761u) : smooth;
    }
}

}  // namespace

TestDump makeDump(const Window& data, const std::vector<DumpChannel>& channels, const CountOf& count,
                  std::uint32_t seed) {
    TestDump dump;
    dump.header.data = data;
    dump.header.display = data;
    dump.header.channels = channels;
    SampleBand& all = dump.all;
    all.x = data.x;
    all.y = data.y;
    all.width = data.width;
    all.height = data.height;
    all.offsets.push_back(0);
    for (int row = 0; row < data.height; ++row)
        for (int col = 0; col < data.width; ++col)
            all.offsets.push_back(all.offsets.back() + static_cast<std::uint64_t>(count(col, row)));
    std::mt19937 random(seed);
    for (const auto& channel : channels) {
        all.channels.push_back(channel.name);
        auto& values = all.values.emplace_back();
        const bool constant = random() % 4 == 0;
        for (std::size_t i = 0; i < all.samples(); ++i) {
            const std::uint32_t bits = random();
            const float noise = constant ? 0.0f : static_cast<float>(bits % 1024) * 1e-4f;
            const float smooth = 1.0f + std::sin(static_cast<float>(i) * 0.01f) * (constant ? 0.0f : 1.0f);
            values.push_back(exactValue(channel.type, bits, smooth + noise));
        }
    }
    return dump;
}

SampleBand rowsOf(const SampleBand& all, int row, int rows) {
    SampleBand band;
    band.x = all.x;
    band.y = all.y + row;
    band.width = all.width;
    band.height = rows;
    band.channels = all.channels;
    const auto first = static_cast<std::size_t>(row) * static_cast<std::size_t>(all.width);
    const auto last = first + static_cast<std::size_t>(rows) * static_cast<std::size_t>(all.width);
    const auto begin = static_cast<std::ptrdiff_t>(all.offsets[first]);
    const auto end = static_cast<std::ptrdiff_t>(all.offsets[last]);
    for (std::size_t p = first; p <= last; ++p) band.offsets.push_back(all.offsets[p] - all.offsets[first]);
    for (const auto& values : all.values)
        band.values.emplace_back(values.begin() + begin, values.begin() + end);
    return band;
}

SampleBand channelsOf(const SampleBand& all, const std::vector<std::string>& names) {
    SampleBand band = all;
    band.channels = names;
    band.values.clear();
    for (const auto& name : names)
        band.values.push_back(all.values[static_cast<std::size_t>(all.channel(name))]);
    return band;
}

void writeDump(const std::string& path, const TestDump& dump, int bandRows) {
    DumpWriter writer(path, dump.header);
    for (int row = 0; row < dump.all.height; row += bandRows)
        writer.write(rowsOf(dump.all, row, std::min(bandRows, dump.all.height - row)));
    writer.close();
}

void expectSame(const SampleBand& expected, const SampleBand& found) {
    EXPECT_EQ(expected.x, found.x);
    EXPECT_EQ(expected.y, found.y);
    EXPECT_EQ(expected.width, found.width);
    EXPECT_EQ(expected.height, found.height);
    ASSERT_EQ(expected.offsets, found.offsets);
    ASSERT_EQ(expected.channels, found.channels);
    ASSERT_EQ(expected.values.size(), found.values.size());
    for (std::size_t c = 0; c < expected.values.size(); ++c) {
        ASSERT_EQ(expected.values[c].size(), found.values[c].size());
        for (std::size_t i = 0; i < expected.values[c].size(); ++i) {
            const float a = expected.values[c][i], b = found.values[c][i];
            if (std::isnan(a) && std::isnan(b)) continue;
            ASSERT_EQ(std::bit_cast<std::uint32_t>(a), std::bit_cast<std::uint32_t>(b))
                << expected.channels[c] << " of sample " << i << ": " << a << " became " << b;
        }
    }
}

std::vector<unsigned char> fileBytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void writeBytes(const std::string& path, const std::vector<unsigned char>& bytes) {
    std::remove(path.c_str());  // file systems flush a file that is overwritten, not one that is new
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

bool anyContains(const std::vector<std::string>& texts, const std::string& part) {
    return std::any_of(texts.begin(), texts.end(),
                       [&](const std::string& text) { return text.find(part) != std::string::npos; });
}

std::string errorOf(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        return error.what();
    }
    ADD_FAILURE() << "expected an Error";
    return {};
}

}  // namespace vlx
