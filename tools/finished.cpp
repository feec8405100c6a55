#include "finished.h"

#include "tool_main.h"

namespace vlx {

namespace {

// Options that change no pixel, and those that are counted in another way.
const std::set<std::string>& notCounted() {
    static const std::set<std::string> names = {
        "--help",   "--help-man",     "--completion", "--version",    "--log",
        "--quiet",  "--json",         "--threads",    "--max-memory", "--overwrite",
        "--output", "--sampling-map", "--band",       "--frames",     "--pictures",
        "--passes", "--fail-above",   "--fail-below", "--stddev",     "--reference-stddev"};
    return names;
}

// Of the program that runs, also where its file has been replaced meanwhile.
const std::string& ownFingerprint() {
    static const std::string own = fileFingerprint("/proc/self/exe");
    return own;
}

}  // namespace

Fingerprint fingerprintOf(const CLI::App& app, const std::set<std::string>& files) {
    Fingerprint result;
    result.add("program", app.get_parent() == nullptr ? app.get_name()
                                                      : app.get_parent()->get_name() + " " + app.get_name());
    result.add("program", ownFingerprint());
    for (const CLI::Option* option : app.get_options([](const CLI::Option*) { return true; })) {
        const std::string name = option->get_single_name();
        const std::string full = option->get_positional() ? name : "--" + name;
        if (notCounted().contains(full) || files.contains(full)) continue;
        if (option->empty()) {
            result.add(full, option->get_default_str());
            continue;
        }
        for (const std::string& value : option->results()) result.add(full, value);
    }
    return result;
}

Fingerprint fingerprintOf(const CLI::App& app, const std::set<std::string>& fileOptions,
                          const std::vector<std::string>& files) {
    Fingerprint result = fingerprintOf(app, fileOptions);
    for (const std::string& file : files) {
        result.add("file", file.empty() ? "none" : "given");  // which of them
        result.addFile(file);
    }
    return result;
}

bool isFinished(const std::vector<std::string>& outputs, const std::string& inputs) {
    if (!areMadeOf(outputs, inputs)) return false;
    say(outputs.front() + ": is finished (same inputs and parameters), skipped; --overwrite makes it again");
    return true;
}

void addOverwrite(CLI::App& app, bool& overwrite) {
    app.add_flag(
        "--overwrite", overwrite,
        "Run even if the output is there and was made by this very program from the same inputs with "
        "the same parameters, which is else skipped");
}

}  // namespace vlx
