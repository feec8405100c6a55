#include "exr/header_walker.h"

#include <algorithm>

#include "exr/little_endian.h"
#include "variolux/base/error.h"

namespace vlx {

namespace {

// Longest name that OpenEXR writes.
constexpr std::size_t kMaxName = 255;

}  // namespace

std::uint32_t HeaderWalker::word() {
    if (!has(4)) return 0;
    at_ += 4;
    return loadWord(bytes_.data() + at_ - 4);
}

std::vector<RawAttribute> HeaderWalker::header() {
    std::vector<RawAttribute> attributes;
    while (!ranOut_) {
        RawAttribute attribute;
        attribute.begin = at_;
        attribute.name = text();
        if (ranOut_ || attribute.name.empty()) break;
        attribute.type = text();
        const std::uint32_t size = word();
        if (ranOut_) break;
        if (size > fileBytes_ - std::min<std::uint64_t>(fileBytes_, at_))
            throw Error(path_, "attribute '" + attribute.name + "' claims " + std::to_string(size) +
                                   " bytes, the whole file has " + std::to_string(fileBytes_));
        attribute.value = at_;
        if (!has(size)) break;
        at_ += size;
        attribute.end = at_;
        attributes.push_back(std::move(attribute));
    }
    return attributes;
}

bool HeaderWalker::has(std::size_t count) {
    if (count <= bytes_.size() - at_) return true;
    if (bytes_.size() == fileBytes_) throw Error(path_, "truncated: the file ends within its header");
    ranOut_ = true;
    return false;
}

std::string HeaderWalker::text() {
    std::string name;
    while (has(1)) {
        const char c = static_cast<char>(bytes_[at_++]);
        if (c == 0) break;
        name += c;
        if (name.size() > kMaxName) throw Error(path_, "damaged header: an endless attribute name");
    }
    return name;
}

const RawAttribute* findAttribute(const std::vector<RawAttribute>& attributes, std::string_view name) {
    for (const auto& attribute : attributes)
        if (attribute.name == name) return &attribute;
    return nullptr;
}

std::string rawText(const Bytes& bytes, const RawAttribute* attribute) {
    if (attribute == nullptr || attribute->type != "string") return {};
    return {bytes.begin() + static_cast<std::ptrdiff_t>(attribute->value),
            bytes.begin() + static_cast<std::ptrdiff_t>(attribute->end)};
}

std::optional<std::int32_t> rawInt(const Bytes& bytes, const RawAttribute* attribute) {
    if (attribute == nullptr || attribute->type != "int" || attribute->end - attribute->value != 4)
        return std::nullopt;
    return static_cast<std::int32_t>(loadWord(bytes.data() + attribute->value));
}

Window checkedWindow(const std::string& path, const std::string& what, std::int64_t x0, std::int64_t y0,
                     std::int64_t x1, std::int64_t y1) {
    const std::int64_t width = x1 - x0 + 1, height = y1 - y0 + 1;
    if (!isPossible(x0, y0, width, height))
        throw Error(path, "expected a " + what + " of pixels within 2^30 of 0, found " +
                              std::to_string(width) + " x " + std::to_string(height) + " pixels at (" +
                              std::to_string(x0) + ", " + std::to_string(y0) + ")");
    return {static_cast<int>(x0), static_cast<int>(y0), static_cast<int>(width), static_cast<int>(height)};
}

}  // namespace vlx
