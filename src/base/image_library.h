#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "variolux/base/window.h"

/// OpenImageIO behind plain types, in a module of its own (openimageio.cpp) that is loaded when a file needs
/// it: its two hundred libraries would take every program 0.2 s to start.
namespace vlx {

/// Of one part of an image file.
struct ImageInfo {
    Window data, display;
    int depth = 1, tileWidth = 0, tileHeight = 0;  ///< tiles: 0 where the file has scanlines
    bool deep = false;
    bool bytes = false;                        ///< values are stored in 8 bits
    std::uint64_t pixelBytes = 0;              ///< as stored
    std::vector<std::string> channels, types;  ///< "half", "float", ...
    std::string format;                        ///< of the file: "openexr", "png", ...
    std::string part;                          ///< the part's name

    /// An attribute, found whatever the case of its name: "" or nothing where there is none of the kind.
    std::string text(const std::string& name) const;
    std::optional<double> number(const std::string& name) const;
    std::map<std::string, std::string> texts;  ///< of lower-case names
    std::map<std::string, double> numbers;
};

/// A file that is read. Rows and columns are those of the data window; false: error() says why.
class ImageInput {
  public:
    virtual ~ImageInput() = default;
    virtual const ImageInfo& info() const = 0;  ///< of the part sought last, until the next is sought
    virtual bool seek(int part) = 0;
    /// Channels [begin, end) of the rows [y, until), interleaved; of whole rows of tiles.
    virtual bool readRows(int part, int y, int until, int begin, int end, float* out) = 0;
    virtual bool readTileRows(int part, int y, int until, int begin, int end, float* out) = 0;
    virtual bool readStored(int y, int until, void* out) = 0;  ///< of part 0, as stored
    virtual bool readAll(int part, float* out) = 0;
    virtual bool readAll(std::uint8_t* out) = 0;
    virtual std::string error() = 0;
};

struct ImageOutputFormat {
    Window data, display;
    std::vector<std::string> channels;
    bool half = false;
    std::map<std::string, std::string> attributes;
};

/// A file that is written; false: error() says why.
class ImageOutput {
  public:
    virtual ~ImageOutput() = default;
    virtual std::string format() const = 0;
    /// What is written goes to memory() from now on, instead of to the file.
    virtual bool toMemory() = 0;
    virtual std::span<const unsigned char> memory() const = 0;
    virtual bool open(const std::string& path, const ImageOutputFormat& format) = 0;
    /// With everything that the input's first part has, but another data window and inputs ("": none).
    virtual bool openLike(const std::string& path, const ImageInput& input, const Window& data,
                          const std::string& inputs) = 0;
    virtual bool write(int y, int until, const float* rows) = 0;
    virtual bool writeStored(int y, int until, const void* rows) = 0;
    virtual bool close() = 0;
    virtual std::string error() = 0;
};

class ImageLibrary {
  public:
    virtual ~ImageLibrary() = default;
    /// Null: `fault` says why.
    virtual std::unique_ptr<ImageInput> open(const std::string& path, std::string& fault) const = 0;
    /// A file of that extension (".png") in memory, which must stay there; colours as they are stored, not
    /// multiplied by alpha.
    virtual std::unique_ptr<ImageInput> open(std::span<const unsigned char> bytes,
                                             const std::string& extension, std::string& fault) const = 0;
    /// Of the format that the path's extension says.
    virtual std::unique_ptr<ImageOutput> create(const std::string& path, std::string& fault) const = 0;
};

/// Loads it, the first time. Throws Error when it is not where it was installed.
const ImageLibrary& imageLibrary();

}  // namespace vlx
