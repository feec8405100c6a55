#include "variolux/base/fingerprint.h"

#include <sys/stat.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>

#include "variolux/base/error.h"
#include "variolux/base/hash.h"
#include "variolux/base/image_io.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

constexpr std::string_view kBand = " band ";

std::string digest(std::string_view text) {
    ContentHash hash;
    hash.add(std::as_bytes(std::span(text)));
    return hexText(hash.value());
}

std::string identityOf(const std::string& path) {
    struct stat is {};
    if (::stat(path.c_str(), &is) != 0) return {};
    std::string text;
    for (const auto part :
         {static_cast<std::int64_t>(is.st_dev), static_cast<std::int64_t>(is.st_ino),
          static_cast<std::int64_t>(is.st_size), static_cast<std::int64_t>(is.st_mtim.tv_sec),
          static_cast<std::int64_t>(is.st_mtim.tv_nsec)})
        text += std::to_string(part) + ' ';
    return text;
}

// Nothing when it is no file that can be read.
std::optional<std::string> digestOfFile(const std::string& path) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(path, ignored)) return std::nullopt;
    std::ifstream file(path, std::ios::binary);
    ContentHash hash;
    std::vector<char> buffer(1 << 20);
    while (file) {
        file.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
        hash.add(std::as_bytes(std::span(buffer).first(static_cast<std::size_t>(file.gcount()))));
    }
    if (!file.eof()) return std::nullopt;
    return hexText(hash.value());
}

}  // namespace

Fingerprint& Fingerprint::add(std::string_view name, std::string_view value) {
    folded_ += digest(std::string(name) + '=' + std::string(value));
    return *this;
}

Fingerprint& Fingerprint::addFile(const std::string& path) {
    if (path.empty()) return *this;
    files_.push_back({path, identityOf(path)});
    folded_ += digestOfFile(path).value_or(digest({}));
    return *this;
}

void Fingerprint::checkUnchanged() const {
    for (const File& file : files_)
        if (identityOf(file.path) != file.identity) throw Error(file.path, "changed while it was read");
}

std::string Fingerprint::text(const Band& band) const { return inputsOfBand(digest(folded_), band); }

std::string fileFingerprint(const std::string& path) {
    if (const auto found = digestOfFile(path)) return *found;
    throw Error(path, "expected a file that can be read");
}

std::string inputsOfBand(const std::string& whole, const Band& band) {
    if (band.count <= 1) return whole;
    return whole + std::string(kBand) + std::to_string(band.index + 1) + "/" + std::to_string(band.count);
}

std::optional<std::string> wholeOfBand(const std::string& inputs) {
    const std::size_t end = inputs.find(kBand);
    if (end == std::string::npos) return std::nullopt;
    return inputs.substr(0, end);
}

bool areMadeOf(const std::vector<std::string>& outputs, const std::string& inputs) {
    return std::ranges::all_of(outputs, [&](const std::string& output) {
        std::error_code ignored;
        if (!std::filesystem::is_regular_file(output, ignored)) return false;
        const bool says = output.ends_with(".exr") || output.ends_with(".png");
        return !says || readTextAttribute(output, kInputsAttribute) == inputs;
    });
}

}  // namespace vlx
