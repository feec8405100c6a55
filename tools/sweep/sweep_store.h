#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "sweep/sweep.h"

namespace vlx {

std::uint64_t textHash(std::string_view text, std::uint64_t hash = 0);

/// 16 hexadecimal digits.
std::string hexText(std::uint64_t value);

/// What tells a file from another: a hash of its content; of files above 64 MiB of their size, time of change
/// and first MiB. Throws Error when it is no file that can be read.
std::string fileIdentity(const std::string& path);

/// A sweep's results.jsonl: held against other sweeps, read once, then added to.
class ResultsFile {
  public:
    /// Cuts off a last line without its end, which was being written when a sweep died. Throws Error when
    /// another process holds the file, or another line is no record; it is then left as it is. `anew`: starts
    /// with none of its records.
    explicit ResultsFile(const std::string& path, bool anew = false);

    /// The last record of this key, unless it is a failure's.
    const SweepRecord* find(const std::string& key) const;

    /// Appends the record, and returns when it is on the disk.
    void add(const SweepRecord& record);

  private:
    struct Descriptor {
        int value = -1;
        Descriptor() = default;
        ~Descriptor();
        Descriptor(const Descriptor&) = delete;
        Descriptor& operator=(const Descriptor&) = delete;
    };

    std::string path_;
    Descriptor fd_;
    std::map<std::string, SweepRecord> records_;
};

}  // namespace vlx
