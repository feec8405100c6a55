#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exr/chunk_codec.h"
#include "variolux/base/window.h"

namespace vlx {

/// Where an attribute is in the bytes of a header.
struct RawAttribute {
    std::string name;
    std::string type;
    std::size_t begin = 0;  ///< of name, type, size and value
    std::size_t value = 0;
    std::size_t end = 0;
};

/// Goes over the bytes of an OpenEXR header without trusting a size in them. OpenEXRCore 3.1.5 cannot do it:
/// it refuses every file of deep and flat parts, as dumps are and OpenEXR itself writes them ("'version'
/// attribute for deep file not found"), and believes windows that the file is too short for.
class HeaderWalker {
  public:
    /// `bytes` are the first of a file of `fileBytes` bytes, perhaps not all of its header; `path` is for
    /// messages. All three must outlive the walker.
    HeaderWalker(const std::string& path, const Bytes& bytes, std::uint64_t fileBytes)
        : path_(path), bytes_(bytes), fileBytes_(fileBytes) {}

    std::size_t position() const { return at_; }
    /// Whether something was asked for that lies behind `bytes` but within the file; it was not given.
    bool ranOut() const { return ranOut_; }

    /// The next four bytes.
    std::uint32_t word();
    /// The attributes up to the empty name that ends a part's header; none when the list of parts ends here.
    /// Throws Error on an attribute that does not lie within the file.
    std::vector<RawAttribute> header();

  private:
    bool has(std::size_t count);
    std::string text();

    const std::string& path_;
    const Bytes& bytes_;
    const std::uint64_t fileBytes_;
    std::size_t at_ = 0;
    bool ranOut_ = false;
};

/// The attribute of this name, or null.
const RawAttribute* findAttribute(const std::vector<RawAttribute>& attributes, std::string_view name);

/// Value of a string attribute; empty when there is none.
std::string rawText(const Bytes& bytes, const RawAttribute* attribute);

/// Value of an integer attribute; nothing when there is none.
std::optional<std::int32_t> rawInt(const Bytes& bytes, const RawAttribute* attribute);

/// The window of pixels [x0, x1] by [y0, y1], as headers state it. Throws Error, with `what` for its name,
/// when it is none that can be.
Window checkedWindow(const std::string& path, const std::string& what, std::int64_t x0, std::int64_t y0,
                     std::int64_t x1, std::int64_t y1);

}  // namespace vlx
