#pragma once

#include <cstdint>
#include <string>

#include "exr/chunk_codec.h"

namespace vlx {

/// An open file whose bytes are read and written at given positions, also from several threads at once.
/// Every function throws Error (naming `name`) when the system refuses.
class RawFile {
  public:
    enum class Mode { Read, Write };
    /// Opens the existing regular file `path`; messages call it `name`.
    RawFile(std::string name, const std::string& path, Mode mode);
    ~RawFile();
    RawFile(const RawFile&) = delete;
    RawFile& operator=(const RawFile&) = delete;

    const std::string& name() const { return name_; }
    std::uint64_t size() const;
    /// All bytes of `to`, from `position` on.
    void readAt(std::uint64_t position, std::span<unsigned char> to) const;
    void writeAt(std::uint64_t position, std::span<const unsigned char> bytes) const;
    /// Reports write errors that come late; the destructor closes too, silently.
    void close();

  private:
    [[noreturn]] void refuse(const char* what) const;

    const std::string name_;
    int descriptor_ = -1;
};

}  // namespace vlx
