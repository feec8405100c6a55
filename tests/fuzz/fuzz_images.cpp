// Flat images: stacks, half-buffers, moments, BCD's statistics, merging. The first byte says which.

#include "edit/merge.h"
#include "fuzz_file.h"
#include "import/bcd.h"
#include "import/moments.h"
#include "import/stack.h"
#include "variolux/base/error.h"

namespace {

void import(std::uint8_t which, const std::string& in, const std::string& out) {
    vlx::MomentOptions moments;
    moments.samples = 4;
    switch (which % 5) {
        case 0:
            vlx::stackImages({in, in}, out, {});
            break;
        case 1:
            vlx::importBuffers(in, in, out, {});
            break;
        case 2:
            vlx::importMoments(in, out, moments);
            break;
        case 3:
            vlx::importBcdStatistics(in, in, in, out, {});
            break;
        default:
            vlx::mergeParts({in}, out, {.crop = true});
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static vlx::FuzzFile file(".exr");
    if (size == 0) return 0;
    try {
        import(data[0], file.with(data + 1, size - 1), file.output());
    } catch (const vlx::Error&) {
    }
    return 0;
}
