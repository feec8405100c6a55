#pragma once

#include <map>
#include <string>

#include "sweep/sweep.h"

namespace vlx {

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
