#include <fnmatch.h>

#include <algorithm>
#include <filesystem>

#include "import/import.h"
#include "variolux/base/error.h"

namespace vlx {

namespace {

namespace fs = std::filesystem;

bool isDigits(const std::string& text) {
    return std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

// Files of a folder whose names fit '*' and '?'; '[' is an ordinary character.
std::vector<std::string> filesLike(const std::string& path, const fs::path& folder, const std::string& name) {
    std::string pattern;
    for (const char c : name) pattern += (c == '[' || c == '\\') ? std::string("\\") + c : std::string(1, c);
    std::vector<std::string> files;
    std::error_code failed;
    for (fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, failed), end;
         !failed && entry != end; entry.increment(failed))
        if (const std::string found = entry->path().filename().string();
            fnmatch(pattern.c_str(), found.c_str(), FNM_PERIOD) == 0)
            files.push_back((folder / found).string());
    if (files.empty()) throw Error(path, "expected files that fit the name, found none");
    std::sort(files.begin(), files.end(), [](const std::string& a, const std::string& b) {
        return std::pair(a.size(), a) < std::pair(b.size(), b);
    });
    return files;
}

std::vector<std::string> filesOf(const std::string& path, const fs::path& folder, const std::string& before,
                                 std::size_t digits, const std::string& after) {
    std::vector<std::pair<std::string, std::string>> found;  // number, path
    std::error_code failed;
    for (fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, failed), end;
         !failed && entry != end; entry.increment(failed)) {
        const std::string name = entry->path().filename().string();
        if (name.size() < before.size() + digits + after.size() || !name.starts_with(before) ||
            !name.ends_with(after))
            continue;
        const std::string number = name.substr(before.size(), name.size() - before.size() - after.size());
        if (!isDigits(number) || (number.size() > digits && number.front() == '0')) continue;
        found.emplace_back(number, (folder / name).string());
    }
    if (found.empty())
        throw Error(path, "expected files with a number of " + std::to_string(digits) +
                              " digits or more in place of '#', found none");
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
        return std::pair(a.first.size(), a.first) < std::pair(b.first.size(), b.first);
    });
    std::vector<std::string> files;
    for (auto& [number, file] : found) files.push_back(std::move(file));
    return files;
}

}  // namespace

std::vector<std::string> expandSequences(const std::vector<std::string>& paths) {
    std::vector<std::string> files;
    for (const auto& path : paths) {
        const fs::path whole(path);
        const std::string name = whole.filename().string();
        const std::size_t begin = name.find('#');
        std::error_code ignored;
        const bool wild = name.find_first_of("*?") != std::string::npos;
        if ((begin == std::string::npos && !wild) || fs::exists(whole, ignored)) {
            files.push_back(path);
            continue;
        }
        if (wild) {
            if (begin != std::string::npos)
                throw Error(path,
                            "expected #### for all numbers, or * and ? for all that fits, found both in a "
                            "name (with --frames LIST #### is the frame's number)");
            const auto like = filesLike(path, whole.parent_path(), name);
            files.insert(files.end(), like.begin(), like.end());
            continue;
        }
        const std::size_t end = std::min(name.find_first_not_of('#', begin), name.size());
        const auto sequence =
            filesOf(path, whole.parent_path(), name.substr(0, begin), end - begin, name.substr(end));
        files.insert(files.end(), sequence.begin(), sequence.end());
    }
    return files;
}

}  // namespace vlx
