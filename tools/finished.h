#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "variolux/base/window.h"

/// Finished work is recognised by what it was made of, which its files say in the text attribute
/// kInputsAttribute of base/image_io.h.
namespace vlx {

/// Hash (XXH64) of all that a run's result depends on.
class InputsHash {
  public:
    /// Of the program (its name and what is in its own file: one that was built anew from other sources does
    /// its work anew, a copy does not) and every option of its command line but those that change no pixel
    /// (--threads, --log, --json, ...), the names of outputs, --band and --frames, and `files`: options that
    /// name input files, which count by what is in them, through addFile(). An option that is not given
    /// counts by its default.
    InputsHash(const CLI::App& app, const std::set<std::string>& files);

    void add(const std::string& name, const std::string& value);
    /// The contents of a file, read as a stream. An empty name is no file; one that cannot be read counts as
    /// empty: whoever reads it will say so.
    void addFile(const std::string& path);
    /// Throws Error when a file has become another one since it was added: what was read of it may not be
    /// what the hash is of.
    void checkUnchanged() const;

    /// 16 hexadecimal digits, and "band 2/5" after them where only a band is made.
    std::string text(const Band& band = {}) const;

  private:
    struct File {
        std::string path;
        std::string identity;  ///< which file it was, its size and the time of its last change
    };

    void addBytes(const std::string& bytes);

    std::string folded_;  ///< digests of what was added
    std::vector<File> files_;
};

/// Whether all `outputs` are there, and those that are images say that they are made of `inputs`. If so,
/// it is said on standard error, unless the run is quiet.
bool isFinished(const std::vector<std::string>& outputs, const std::string& inputs);

/// The hash of a command whose result depends on its options and on what is in `files`, which `fileOptions`
/// name.
std::string inputsOf(const CLI::App& app, const std::set<std::string>& fileOptions,
                     const std::vector<std::string>& files);

/// Adds the option --overwrite.
void addOverwrite(CLI::App& app, bool& overwrite);

}  // namespace vlx
