// BCD's raw samples.

#include "fuzz_file.h"
#include "import/bcd.h"
#include "variolux/base/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static vlx::FuzzFile file(".raw");
    try {
        vlx::importBcdRaw(file.with(data, size), file.output(), {});
    } catch (const vlx::Error&) {
    }
    return 0;
}
