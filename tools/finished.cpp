#include "finished.h"

#include <sys/stat.h>
#include <xxhash.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>

#include "tool_main.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"

namespace vlx {

namespace {

// Options that change no pixel, and those that are counted in another way.
const std::set<std::string>& notCounted() {
    static const std::set<std::string> names = {
        "--help",       "--help-man",     "--completion", "--version",         "--log",
        "--quiet",      "--json",         "--threads",    "--max-memory",      "--overwrite",
        "--output",     "--sampling-map", "--band",       "--frames",          "--pictures",
        "--fail-above", "--fail-below",   "--stddev",     "--reference-stddev"};
    return names;
}

std::string hex(std::uint64_t value) {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
    return text;
}

std::string identityOf(const std::string& path) {
    struct stat is {};
    if (::stat(path.c_str(), &is) != 0) return {};
    std::string text;
    for (const auto part :
         {static_cast<std::int64_t>(is.st_dev), static_cast<std::int64_t>(is.st_ino),
          static_cast<std::int64_t>(is.st_size), static_cast<std::int64_t>(is.st_mtim.tv_sec),
          static_cast<std::int64_t>(is.st_mtim.tv_nsec)})
        text += std::to_string(part) + ' ';
    return text;
}

// Of what is in a file, read as a stream; of one that cannot be read, of nothing.
std::string hashOfFile(const std::string& path) {
    const std::unique_ptr<XXH64_state_t, XXH_errorcode (*)(XXH64_state_t*)> state(XXH64_createState(),
                                                                                  XXH64_freeState);
    XXH64_reset(state.get(), 0);
    std::error_code ignored;
    std::ifstream file;
    if (std::filesystem::is_regular_file(path, ignored)) file.open(path, std::ios::binary);
    std::vector<char> buffer(1 << 20);
    while (file.is_open() && file) {
        file.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
        XXH64_update(state.get(), buffer.data(), static_cast<std::size_t>(file.gcount()));
    }
    return hex(XXH64_digest(state.get()));
}

// Of the program that runs, also where its file has been replaced meanwhile.
const std::string& ownHash() {
    static const std::string hash = hashOfFile("/proc/self/exe");
    return hash;
}

}  // namespace

InputsHash::InputsHash(const CLI::App& app, const std::set<std::string>& files) {
    add("program",
        app.get_parent() == nullptr ? app.get_name() : app.get_parent()->get_name() + " " + app.get_name());
    add("program", ownHash());
    for (const CLI::Option* option : app.get_options([](const CLI::Option*) { return true; })) {
        const std::string name = option->get_single_name();
        const std::string full = option->get_positional() ? name : "--" + name;
        if (notCounted().contains(full) || files.contains(full)) continue;
        if (option->empty()) {
            add(full, option->get_default_str());
            continue;
        }
        for (const std::string& value : option->results()) add(full, value);
    }
}

void InputsHash::add(const std::string& name, const std::string& value) { addBytes(name + '=' + value); }

void InputsHash::addBytes(const std::string& bytes) { folded_ += hex(XXH64(bytes.data(), bytes.size(), 0)); }

void InputsHash::addFile(const std::string& path) {
    if (path.empty()) return;
    files_.push_back({path, identityOf(path)});
    folded_ += hashOfFile(path);
}

void InputsHash::checkUnchanged() const {
    for (const File& file : files_)
        if (identityOf(file.path) != file.identity) throw Error(file.path, "changed while it was read");
}

std::string InputsHash::text(const Band& band) const {
    const std::string all = hex(XXH64(folded_.data(), folded_.size(), 0));
    return band.count == 1
               ? all
               : all + " band " + std::to_string(band.index + 1) + "/" + std::to_string(band.count);
}

bool isFinished(const std::vector<std::string>& outputs, const std::string& inputs) {
    std::error_code ignored;
    for (const std::string& output : outputs) {
        if (!std::filesystem::is_regular_file(output, ignored)) return false;
        const bool says = output.ends_with(".exr") || output.ends_with(".png");
        if (says && readTextAttribute(output, kInputsAttribute) != inputs) return false;
    }
    say(outputs.front() + ": is finished (same inputs and parameters), skipped; --overwrite makes it again");
    return true;
}

std::string inputsOf(const CLI::App& app, const std::set<std::string>& fileOptions,
                     const std::vector<std::string>& files) {
    InputsHash hash(app, fileOptions);
    for (const std::string& file : files) {
        hash.add("file", file.empty() ? "none" : "given");  // which of them
        hash.addFile(file);
    }
    return hash.text();
}

void addOverwrite(CLI::App& app, bool& overwrite) {
    app.add_flag(
        "--overwrite", overwrite,
        "Run even if the output is there and was made by this very program from the same inputs with "
        "the same parameters, which is else skipped");
}

}  // namespace vlx
