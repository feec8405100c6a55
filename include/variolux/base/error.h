#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace vlx {

/// The one exception of Variolux: something outside the program is not as it must be (a file, a header,
/// an option). Thrown by the library, caught once in each tool's main. Numerical trouble is never an Error:
/// it is a status in a result.
class Error : public std::runtime_error {
  public:
    /// `path`: the file or option concerned (may be empty); `message`: what was expected and what was found.
    /// what() is "path: message".
    Error(std::string_view path, std::string_view message)
        : std::runtime_error(path.empty() ? std::string(message)
                                          : std::string(path) + ": " + std::string(message)),
          path_(path) {}

    const std::string& path() const { return path_; }

  private:
    std::string path_;
};

}  // namespace vlx
