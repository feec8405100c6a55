// Runs a fuzz target on every file of folders, where the compiler has no libFuzzer: fuzz_NAME DIR...

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "../dump/test_dumps.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int main(int argc, char** argv) {
    namespace fs = std::filesystem;
    for (int i = 1; i < argc; ++i) {
        std::vector<fs::path> inputs;
        for (const auto& entry : fs::directory_iterator(argv[i])) inputs.push_back(entry.path());
        std::sort(inputs.begin(), inputs.end());
        if (inputs.empty()) {
            std::fprintf(stderr, "%s: no inputs\n", argv[i]);
            return 1;
        }
        for (const fs::path& input : inputs) {
            std::printf("%s\n",
                        input.c_str());  // before it is read: the last one named is the one that failed
            std::fflush(stdout);
            const std::vector<unsigned char> bytes = vlx::fileBytes(input.string());
            LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
        }
    }
    return argc > 1 ? 0 : 2;
}
