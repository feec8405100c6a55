#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "variolux/base/window.h"

/// Finished work is recognised by what it was made of, which its files say themselves.
namespace vlx {

/// Text attribute of an image or a dump that says what it was made of: Fingerprint::text().
inline constexpr char kInputsAttribute[] = "variolux:inputs";

/// Of all that a result depends on: named values and contents of files, in the order in which they are added
/// (XXH64 of each, and of these).
class Fingerprint {
  public:
    Fingerprint& add(std::string_view name, std::string_view value);
    /// The contents of a file, read as a stream. An empty name is no file; one that cannot be read counts as
    /// empty: whoever reads it will say so.
    Fingerprint& addFile(const std::string& path);
    /// Throws Error when a file has become another one since it was added: what was read of it may not be
    /// what was added.
    void checkUnchanged() const;

    /// 16 hexadecimal digits, and " band 2/5" after them where only a band is made.
    std::string text(const Band& band = {}) const;

  private:
    struct File {
        std::string path;
        std::string identity;  ///< which file it was, its size and the time of its last change
    };

    std::string folded_;  ///< digests of what was added
    std::vector<File> files_;
};

/// The fingerprint of a file's contents alone. Throws Error when it is no file that can be read.
std::string fileFingerprint(const std::string& path);

/// Of what Fingerprint::text() says of a whole, what it says of a band of it: "... band 2/5" of {1, 5}.
std::string inputsOfBand(const std::string& whole, const Band& band);

/// The reverse: what the whole would say; nothing when it is not of a band.
std::optional<std::string> wholeOfBand(const std::string& inputs);

/// Whether all `outputs` are there, and those that are images (.exr, .png) say that they are made of
/// `inputs`.
bool areMadeOf(const std::vector<std::string>& outputs, const std::string& inputs);

}  // namespace vlx
