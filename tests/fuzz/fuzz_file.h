#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace vlx {

/// A file that holds what a fuzzer made up, and the name of one to write, in memory where the system has such
/// a folder. One of each for a process; both are gone after it.
class FuzzFile {
  public:
    /// `ending` is that of the file to read: ".exr".
    explicit FuzzFile(const std::string& ending);
    ~FuzzFile();

    /// Writes the bytes; the file's name.
    const std::string& with(const std::uint8_t* data, std::size_t size);
    const std::string& input() const { return input_; }
    const std::string& output() const { return output_; }

  private:
    std::string folder_, input_, output_;
};

}  // namespace vlx
