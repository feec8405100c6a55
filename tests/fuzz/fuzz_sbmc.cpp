// SBMC's tiles.

#include "fuzz_file.h"
#include "import/sbmc.h"
#include "variolux/base/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static vlx::FuzzFile file(".bin");
    try {
        vlx::importSbmc({file.with(data, size)}, file.output(), {});
    } catch (const vlx::Error&) {
    }
    return 0;
}
