#include "fuzz_file.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>

namespace vlx {

FuzzFile::FuzzFile(const std::string& ending) {
    namespace fs = std::filesystem;
    const fs::path base = fs::is_directory("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path();
    folder_ = (base / "variolux-fuzz-XXXXXX").string();
    if (::mkdtemp(folder_.data()) == nullptr) std::abort();
    input_ = folder_ + "/input" + ending;
    output_ = folder_ + "/output.exr";
}

FuzzFile::~FuzzFile() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
}

const std::string& FuzzFile::with(const std::uint8_t* data, std::size_t size) {
    std::FILE* const file = std::fopen(input_.c_str(), "wb");
    if (file == nullptr || std::fwrite(data, 1, size, file) != size || std::fclose(file) != 0) std::abort();
    return input_;
}

}  // namespace vlx
