#include "opinion/denoiser.h"

#include <unistd.h>

#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>

#include "edit/halves.h"
#include "process/child_process.h"
#include "tool_main.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/base/parallel.h"

namespace fs = std::filesystem;

namespace vlx {

namespace {

constexpr const char* kOidn = "oidn";

/// Files of a denoiser's folder, and it, to be removed when a signal ends the program. Written before the
/// first command runs.
std::vector<std::string> leftBehind;

void endDenoiser() noexcept {
    endRunningCommand();
    for (const std::string& name : leftBehind)
        if (::unlink(name.c_str()) != 0) ::rmdir(name.c_str());
}

/// A folder of its own, removed with all that is in it.
class TemporaryFolder {
  public:
    TemporaryFolder() {
        std::error_code code;
        std::string name = (fs::temp_directory_path(code) / "vlx-krige-XXXXXX").string();
        if (code || !::mkdtemp(name.data()))
            throw Error(code ? std::string("TMPDIR") : name,
                        "no temporary folder can be made there: TMPDIR names another place");
        path_ = name;
    }
    ~TemporaryFolder() {
        leftBehind.clear();
        std::error_code code;
        fs::remove_all(path_, code);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const std::string& path() const { return path_; }

  private:
    std::string path_;
};

std::string replaced(std::string word, const std::map<std::string, std::string>& places) {
    for (const auto& [name, value] : places) {
        const std::string place = "{" + name + "}";
        for (std::size_t at = word.find(place); at != std::string::npos;
             at = word.find(place, at + value.size()))
            word.replace(at, place.size(), value);
    }
    return word;
}

void runDenoiser(const std::vector<std::string>& words) {
    const ProcessRun run = runProgram(words);
    if (run.exitCode == 0) return;
    std::string all;
    for (const std::string& word : words) all += (all.empty() ? "" : " ") + shellQuoted(word);
    std::string why = run.exitCode == 127 ? "was not found in PATH"
                      : run.exitCode < 0  ? "was ended by signal " + std::to_string(-run.exitCode)
                                          : "failed with exit code " + std::to_string(run.exitCode);
    std::string said = run.err.empty() ? run.out : run.err;
    while (!said.empty() && std::isspace(static_cast<unsigned char>(said.back()))) said.pop_back();
    constexpr std::size_t kMostSaid = 1000;
    if (said.size() > kMostSaid) said = "..." + said.substr(said.size() - kMostSaid);
    throw Error(words[0], "the denoiser " + why + (said.empty() ? "" : ": " + said) + " (" + all + ")");
}

/// Of the pictures PREFIX_color.pfm and so on, with Open Image Denoise's program.
void runOidn(const std::string& prefix, const std::string& output, int threads) {
    std::vector<std::string> limit;
    if (threads > 0) limit = {"--threads", std::to_string(threads)};
    std::vector<std::string> words = {"oidnDenoise", "--hdr", prefix + "color.pfm"};
    bool features = false;
    for (const auto& [option, name] : {std::pair{"--alb", "albedo"}, {"--nrm", "normal"}}) {
        const std::string noisy = prefix + name + ".pfm", clean = prefix + name + "_clean.pfm";
        // OIDN takes normals with an albedo only.
        if (!fs::exists(noisy) || (std::string(name) == "normal" && !features)) continue;
        std::vector<std::string> cleaning = {"oidnDenoise", option, noisy, "-o", clean};
        cleaning.insert(cleaning.end(), limit.begin(), limit.end());
        runDenoiser(cleaning);
        words.insert(words.end(), {option, clean});
        features = true;
    }
    if (features) words.emplace_back("--clean_aux");
    words.insert(words.end(), {"-o", output});
    words.insert(words.end(), limit.begin(), limit.end());
    runDenoiser(words);
}

}  // namespace

std::vector<std::string> wordsOf(const std::string& command) {
    std::vector<std::string> words;
    bool inWord = false;
    char quote = 0;
    for (std::size_t i = 0; i < command.size(); ++i) {
        const char c = command[i];
        if (quote == 0 && std::isspace(static_cast<unsigned char>(c))) {
            inWord = false;
            continue;
        }
        if (!inWord) words.emplace_back();
        inWord = true;
        if (c == '\\' && quote != '\'' && i + 1 < command.size())
            words.back() += command[++i];
        else if (quote == 0 && (c == '\'' || c == '"'))
            quote = c;
        else if (c == quote)
            quote = 0;
        else
            words.back() += c;
    }
    if (quote != 0) throw Error("", "expected a closing " + std::string(1, quote) + " in: " + command);
    if (words.empty() || words[0].empty()) throw Error("", "expected a denoiser's command, found none");
    return words;
}

void checkDenoiser(const std::string& command) {
    if (command == kOidn) return;
    std::string all;
    for (const std::string& word : wordsOf(command)) all += word + " ";
    for (const char* needed : {"{color}", "{output}"})
        if (all.find(needed) == std::string::npos)
            throw Error("", std::string("expected ") + needed +
                                " in a denoiser's command, for the file that it is to " +
                                (std::string(needed) == "{color}" ? "read" : "write") + ", found none");
    for (std::size_t at = all.find('{'); at != std::string::npos; at = all.find('{', at + 1)) {
        const std::size_t end = all.find_first_of("} ", at);
        const std::string name = all.substr(at + 1, end - at - 1);
        const bool known =
            name == "color" || name == "albedo" || name == "normal" || name == "output" || name == "threads";
        if (!known || all[end] != '}')
            throw Error("", "expected {color}, {albedo}, {normal}, {output} or {threads}, found {" + name);
    }
}

std::vector<std::string> denoiserFiles(const std::string& command) {
    std::vector<std::string> words =
        command == kOidn ? std::vector<std::string>{"oidnDenoise"} : wordsOf(command);
    std::vector<std::string> files;
    std::error_code ignored;
    if (words[0].find('/') == std::string::npos) {
        const char* path = std::getenv("PATH");
        std::istringstream folders(path ? path : "");
        for (std::string folder; std::getline(folders, folder, ':');)
            if (const std::string found = folder + "/" + words[0]; ::access(found.c_str(), X_OK) == 0) {
                words[0] = found;
                break;
            }
    }
    for (const std::string& word : words)
        if (fs::is_regular_file(word, ignored)) files.push_back(word);
    return files;
}

SecondOpinion denoise(const std::string& command, const std::string& input, const Window& window,
                      int threads) {
    const std::vector<std::string> words = command == kOidn ? std::vector<std::string>() : wordsOf(command);
    const TemporaryFolder folder;
    const std::string prefix = folder.path() + "/samples";
    for (const char* part : {"_", "_even_", "_odd_"}) {
        for (const char* name : {"color", "albedo", "normal", "albedo_clean", "normal_clean"})
            leftBehind.push_back(prefix + part + name + ".pfm");
        leftBehind.push_back(folder.path() + "/denoised" + part + "result.pfm");
    }
    leftBehind.push_back(folder.path());
    onEndingSignal(endDenoiser);
    const HalvesReport written = writeHalves(input, prefix);
    const auto imageOf = [&](const std::string& part) {
        const std::string stem = prefix + part, output = folder.path() + "/denoised" + part + "result.pfm";
        if (words.empty()) {
            runOidn(stem, output, threads);
        } else {
            std::map<std::string, std::string> places = {
                {"color", stem + "color.pfm"},
                {"output", output},
                {"threads", std::to_string(threads > 0 ? threads : threadCount())}};
            for (const char* feature : {"albedo", "normal"})
                if (fs::exists(stem + feature + ".pfm")) places[feature] = stem + feature + ".pfm";
            std::vector<std::string> filled;
            for (const std::string& word : words) filled.push_back(replaced(word, places));
            for (const std::string& word : filled)
                for (const char* feature : {"{albedo}", "{normal}"})
                    if (word.find(feature) != std::string::npos)
                        throw Error(input,
                                    "expected the features that the denoiser is to get, found none for " +
                                        std::string(feature));
            runDenoiser(filled);
        }
        if (!fs::exists(output))
            throw Error(words.empty() ? "oidnDenoise" : words[0],
                        "expected the denoiser to write {output} (" + output + "), found no such file");
        return checkedOpinion(readImage(output), output, window);
    };
    SecondOpinion opinion{imageOf("_"), {}};
    // Of one sample a pixel halves tell nothing.
    if (written.missingInHalves + written.emptyPixels < window.pixels())
        opinion.halves = {imageOf("_even_"), imageOf("_odd_")};
    return opinion;
}

}  // namespace vlx
