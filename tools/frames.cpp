#include "frames.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <new>
#include <set>

#include "tool_main.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

constexpr std::size_t kMostFrames = 1'000'000;

// A number at the start of `rest`, which it is taken from.
bool takeNumber(std::string_view& rest, int& number) {
    const auto [end, status] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    if (status != std::errc() || number < 0) return false;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return true;
}

bool takeSign(std::string_view& rest, char sign) {
    if (!rest.starts_with(sign)) return false;
    rest.remove_prefix(1);
    return true;
}

}  // namespace

std::vector<int> parseFrames(const std::string& text) {
    const CLI::ValidationError broken(
        "--frames", "expected frames such as 1-100x2 or 1-3,7,10-20x5, found '" + text + "'");
    std::vector<int> frames;
    std::set<int> seen;
    for (const std::string& part : split(text, ',')) {
        std::string_view rest = part;
        int first = 0, step = 1;
        if (!takeNumber(rest, first)) throw broken;
        int last = first;
        if (takeSign(rest, '-')) {
            if (!takeNumber(rest, last)) throw broken;
            if (takeSign(rest, 'x') && !takeNumber(rest, step)) throw broken;
        }
        if (!rest.empty() || step < 1 || last < first) throw broken;
        for (std::int64_t frame = first; frame <= last; frame += step) {
            if (seen.insert(static_cast<int>(frame)).second) frames.push_back(static_cast<int>(frame));
            if (frames.size() > kMostFrames)
                throw CLI::ValidationError("--frames", "expected at most a million frames");
        }
    }
    return frames;
}

Band parseBand(const std::string& text) {
    std::string_view rest = text;
    int number = 0, count = 0;
    const bool read = takeNumber(rest, number) && takeSign(rest, '/') && takeNumber(rest, count);
    if (!read || !rest.empty() || number < 1 || number > count)
        throw CLI::ValidationError("--band", "expected I/N with 1 <= I <= N, found '" + text + "'");
    return {number - 1, count};
}

std::string frameName(const std::string& name, int frame) {
    const std::size_t start = name.find_last_of('/') == std::string::npos ? 0 : name.find_last_of('/') + 1;
    std::string result = name.substr(0, start);
    for (std::size_t i = start; i < name.size();) {
        const std::size_t end = std::min(name.find_first_not_of('#', i), name.size());
        if (end == i) {
            result += name[i++];
            continue;
        }
        const std::string number = std::to_string(frame);
        result += std::string(std::max(end - i, number.size()) - number.size(), '0') + number;
        i = end;
    }
    return result;
}

void requireFramePlace(const std::string& option, const std::string& name) {
    if (frameName(name, 0) == name)
        throw CLI::ValidationError(
            option,
            "with --frames expected #### in the file's name for the frame's number, found '" + name + "'");
}

Progress progressOfPart(const Progress& whole, std::size_t index, std::size_t count) {
    if (!whole) return {};
    return [whole, index, count](std::int64_t done, std::int64_t total) {
        constexpr std::int64_t kSteps = 1'000'000;
        const std::int64_t part = total > 0 ? kSteps * done / total : 0;
        whole(static_cast<std::int64_t>(index) * kSteps + part, static_cast<std::int64_t>(count) * kSteps);
    };
}

void forEachFrame(const std::vector<int>& frames, const Progress& progress,
                  const std::function<void(int, const Progress&)>& run) {
    std::string failed;
    int failures = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        std::string message;
        try {
            run(frames[i], progressOfPart(progress, i, frames.size()));
            continue;
        } catch (const Error& error) {
            message = error.what();
        } catch (const std::bad_alloc&) {
            message = "out of memory";
        }
        warn("frame " + std::to_string(frames[i]) + ": " + message);
        failed += (failures++ > 0 ? ", " : "") + std::to_string(frames[i]);
    }
    if (failures > 0)
        throw Error("", std::to_string(failures) + " of " + std::to_string(frames.size()) +
                            " frames failed: " + failed);
}

}  // namespace vlx
