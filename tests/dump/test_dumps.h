#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "variolux/dump/band.h"
#include "variolux/dump/format.h"

namespace vlx {

inline constexpr DumpCompression kAllCompressions[] = {DumpCompression::None, DumpCompression::Rle,
                                                       DumpCompression::Zips};

/// A dump held whole: its header and all its rows as one band.
struct TestDump {
    DumpHeader header;
    SampleBand all;
};

/// Channels of every type, named so that their order differs from the one by name.
std::vector<DumpChannel> mixedChannels();

/// Samples of pixel (col, row), counted from the corner.
using CountOf = std::function<int(int col, int row)>;
/// None, one or several: at most 12.
inline const CountOf kAdaptive = [](int col, int row) { return (col * 5 + row * 3) % 7 * ((col + row) % 3); };

/// A dump of pseudo-random values that their types hold exactly: smooth ones, noise, and now and then
/// zeros, infinities, NaN and denormal numbers.
TestDump makeDump(const Window& data, const std::vector<DumpChannel>& channels, const CountOf& count,
                  std::uint32_t seed = 1);

/// Rows [row, row + rows) of `all`, counted from its first.
SampleBand rowsOf(const SampleBand& all, int row, int rows);

/// The channels of `all` in the order of `names`.
SampleBand channelsOf(const SampleBand& all, const std::vector<std::string>& names);

/// Writes the dump with DumpWriter, in bands of `bandRows` rows.
void writeDump(const std::string& path, const TestDump& dump, int bandRows = 5);

/// Same place, counts, channels and values, bit for bit (all NaN count as equal).
void expectSame(const SampleBand& expected, const SampleBand& found);

std::vector<unsigned char> fileBytes(const std::string& path);
void writeBytes(const std::string& path, const std::vector<unsigned char>& bytes);

/// Whether one of the texts contains the part.
bool anyContains(const std::vector<std::string>& texts, const std::string& part);

/// The message of the Error that `action` throws; fails the test when it throws none.
std::string errorOf(const std::function<void()>& action);

}  // namespace vlx
