// The dump reader: any bytes are an Error or consistent bands.

#include <algorithm>
#include <cstdlib>

#include "fuzz_file.h"
#include "variolux/base/error.h"
#include "variolux/dump/reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static vlx::FuzzFile file(".exr");
    try {
        const vlx::DumpReader reader(file.with(data, size));
        const vlx::Window window = reader.header().data;
        for (int row = 0; row < window.height; row += 4) {
            const vlx::SampleBand band = reader.read(window.y + row, std::min(4, window.height - row));
            if (band.offsets.size() != band.pixels() + 1 ||
                !std::is_sorted(band.offsets.begin(), band.offsets.end()))
                std::abort();
            for (const auto& values : band.values)
                if (values.size() != band.samples()) std::abort();
        }
    } catch (const vlx::Error&) {
    }
    return 0;
}
