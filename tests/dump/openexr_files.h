#pragma once

#include <ImfPixelType.h>

#include <string>

#include "test_dumps.h"

namespace vlx {

/// The same type in the words of OpenEXR.
Imf::PixelType pixelType(ChannelType type);

/// What OpenEXR's own classes write and read: the judge of Variolux's reader and writer.
struct OpenExrFile {
    bool decreasingY = false;
    bool severalParts = false;  ///< a flat part, the dump, and another deep part with the rows upside down
    int rowsWritten = -1;       ///< stop after this many rows, as a program that crashed; -1: all
};
void writeWithOpenExr(const std::string& path, const TestDump& dump, const OpenExrFile& how = {});

/// A file of deep tiles, which dumps are not.
void writeDeepTiles(const std::string& path, const TestDump& dump);

/// The part of this number, channels sorted by name.
SampleBand readWithOpenExr(const std::string& path, int part);

}  // namespace vlx
