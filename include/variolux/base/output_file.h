#pragma once

#include <string>
#include <string_view>

namespace vlx {

/// A file under construction: written under a temporary name beside its final one, renamed by commit().
/// Destroyed uncommitted (an exception, an early return), it is deleted: nothing partial ever has the final
/// name.
class OutputFile {
  public:
    /// Throws Error when the folder does not exist or cannot be written to. The temporary name ends with the
    /// final name's extension, so libraries that choose the format by extension write the right one.
    explicit OutputFile(std::string path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    const std::string& path() const { return path_; }
    const std::string& temporaryPath() const { return temporary_; }

    /// Makes `bytes` all that the temporary file holds. Throws Error when the disk refuses.
    void write(std::string_view bytes) const;

    /// Flushes the temporary file to disk and renames it to its final name. Throws Error when that fails.
    void commit();

  private:
    std::string path_;
    std::string temporary_;
    int slot_ = -1;
    bool committed_ = false;
};

/// Writes a whole file, which appears under its name only when it is complete. Throws Error as OutputFile
/// does.
void writeFile(const std::string& path, std::string_view bytes);

/// Deletes the temporary files of all OutputFiles that are under construction (up to 64 at once). For a
/// program's signal handler, before the process ends: async-signal-safe. Afterwards no commit() succeeds.
void removeUnfinishedFiles() noexcept;

}  // namespace vlx
