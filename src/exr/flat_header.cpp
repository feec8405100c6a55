#include "exr/flat_header.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>

#include "exr/header_walker.h"
#include "exr/little_endian.h"
#include "exr/raw_file.h"
#include "variolux/base/error.h"

namespace vlx {

namespace {

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint32_t kDeepData = 0x800;
// Headers are longer only with pictures in them (previews), which are small.
constexpr std::uint64_t kMaxHeader = std::uint64_t{64} << 20;
// zlib reaches 1032, the run lengths of others less. DWA is lossy: of an area of one colour it keeps next to
// nothing.
constexpr std::uint64_t kMostUnpacked = 2048;
constexpr std::uint64_t kMostUnpackedDwa = 1 << 16;
constexpr unsigned char kFirstDwa = 8;
constexpr std::uint64_t kAllowance = std::uint64_t{1} << 20;

// Rows a chunk by number of compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB.
constexpr std::array<std::uint64_t, 10> kChunkRows = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};

std::uint64_t ceilDivide(std::uint64_t a, std::uint64_t b) { return (a + b - 1) / b; }

class PartCheck {
  public:
    PartCheck(const std::string& path, const Bytes& bytes, const std::vector<RawAttribute>& attributes)
        : path_(path), bytes_(bytes), attributes_(attributes) {}

    void operator()(std::uint64_t fileBytes) const {
        window("displayWindow");
        const Window data = window("dataWindow");
        const auto columns = static_cast<std::uint64_t>(data.width),
                   rows = static_cast<std::uint64_t>(data.height);
        std::uint64_t chunks = 0, pixels = columns * rows;  // both factors are below 2^31
        const unsigned char compression = *value("compression", "compression", 1);
        if (findAttribute(attributes_, "tiles") != nullptr) {
            const unsigned char* tiles = value("tiles", "tiledesc", 9);
            const std::uint64_t x = loadWord(tiles), y = loadWord(tiles + 4);
            if (x < 1 || y < 1 || x > 0x7fffffff || y > 0x7fffffff)
                throw Error(path_, "expected tiles with pixels, found " + std::to_string(x) + " x " +
                                       std::to_string(y));
            chunks = ceilDivide(columns, x) * ceilDivide(rows, y);
            pixels = std::max(pixels, x * y);
        } else {
            if (compression >= kChunkRows.size())
                throw Error(path_,
                            "expected a compression of OpenEXR, found number " + std::to_string(compression));
            chunks = ceilDivide(rows, kChunkRows[compression]);
        }
        const std::uint64_t most =
            fileBytes * (compression < kFirstDwa ? kMostUnpacked : kMostUnpackedDwa) + kAllowance;
        if (chunks > fileBytes / 8 || pixels > most / std::max<std::uint64_t>(pixelBytes(), 1))
            throw Error(path_, "truncated or damaged: the header claims " + std::to_string(columns) + " x " +
                                   std::to_string(rows) + " pixels, more than the file's " +
                                   std::to_string(fileBytes) + " bytes can hold");
    }

  private:
    Window window(const char* name) const {
        std::array<std::int32_t, 4> corners{};
        std::memcpy(corners.data(), value(name, "box2i", 16), sizeof corners);
        return checkedWindow(path_, name, corners[0], corners[1], corners[2], corners[3]);
    }

    const unsigned char* value(const char* name, const char* type, std::size_t bytes) const {
        const RawAttribute* found = findAttribute(attributes_, name);
        if (found == nullptr || found->type != type || found->end - found->value != bytes)
            throw Error(path_, std::string("damaged header: attribute '") + name + "' is missing or wrong");
        return bytes_.data() + found->value;
    }

    // A list of channels: name, 0, type and 12 bytes more; then 0.
    std::uint64_t pixelBytes() const {
        const RawAttribute* list = findAttribute(attributes_, "channels");
        if (list == nullptr || list->type != "chlist")
            throw Error(path_, "damaged header: attribute 'channels' is missing or wrong");
        std::uint64_t bytes = 0;
        std::size_t at = list->value;
        while (at < list->end && bytes_[at] != 0) {
            while (at < list->end && bytes_[at] != 0) ++at;
            if (list->end - at < 17) throw Error(path_, "damaged header: the list of channels is cut short");
            bytes += loadWord(bytes_.data() + at + 1) == 1 ? 2 : 4;
            at += 17;
        }
        return bytes;
    }

    const std::string& path_;
    const Bytes& bytes_;
    const std::vector<RawAttribute>& attributes_;
};

}  // namespace

bool isFlatImage(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::array<unsigned char, 8> start{};
    if (!file.read(reinterpret_cast<char*>(start.data()), start.size())) return false;
    return loadWord(start.data()) != kMagic || (loadWord(start.data() + 4) & kDeepData) == 0;
}

void checkFlatHeader(const std::string& path) {
    const RawFile file(path, path, RawFile::Mode::Read);
    const std::uint64_t size = file.size();
    Bytes start(std::min<std::uint64_t>(size, 1 << 16));
    file.readAt(0, start);
    if (start.size() < 8 || loadWord(start.data()) != kMagic) return;
    if ((loadWord(start.data() + 4) & kDeepData) != 0)
        throw Error(path, "expected a flat image, found deep samples: this is a dump already");
    const bool multiPart = (loadWord(start.data() + 4) & 0x1000) != 0;
    for (;;) {
        HeaderWalker walker(path, start, size);
        walker.word();
        walker.word();
        std::vector<std::vector<RawAttribute>> parts;
        do {
            parts.push_back(walker.header());
        } while (multiPart && !walker.ranOut() && !parts.back().empty());
        if (!walker.ranOut()) {
            if (multiPart) parts.pop_back();
            if (parts.empty()) throw Error(path, "expected an image, found an OpenEXR file without parts");
            for (const auto& part : parts) PartCheck(path, start, part)(size);
            return;
        }
        if (start.size() >= kMaxHeader)
            throw Error(path, "expected a header of at most 2^26 bytes, found a longer one");
        const std::size_t before = start.size();
        start.resize(std::min<std::uint64_t>(size, before * 8));
        file.readAt(before, std::span(start).subspan(before));
    }
}

}  // namespace vlx
