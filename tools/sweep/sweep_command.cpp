#include "sweep/sweep_command.h"

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <utility>

#include "variolux/base/error.h"
#include "variolux/base/fingerprint.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// The JSON objects that a text consists of; none where it is something else.
std::vector<Json> objectsOf(const std::string& text) {
    std::vector<Json> objects;
    std::istringstream stream(text);
    while (stream >> std::ws && !stream.eof()) try {
            Json object;
            stream >> object;
            if (!object.is_object()) return {};
            objects.push_back(std::move(object));
        } catch (const Json::exception&) {
            return {};
        }
    return objects;
}

}  // namespace

std::string filled(std::string text, const std::map<std::string, std::string>& places) {
    for (std::size_t at = text.find('{'); at != std::string::npos; at = text.find('{', at)) {
        const std::size_t end = text.find('}', at);
        const auto place =
            end == std::string::npos ? places.end() : places.find(text.substr(at + 1, end - at - 1));
        if (place == places.end()) {
            ++at;  // a brace of the shell's
            continue;
        }
        text.replace(at, end - at + 1, place->second);
        at += place->second.size();
    }
    return text;
}

std::string firstWord(const std::string& command) { return command.substr(0, command.find(' ')); }

std::string namedFiles(const std::string& command) {
    std::string identities;
    std::istringstream words(command);
    std::error_code ignored;
    for (std::string word; words >> word;)
        if (fs::is_regular_file(word, ignored)) identities += fileFingerprint(word);
    return identities;
}

std::string numberText(double value) { return formatted("%.6g", value); }

std::vector<Json> reportsOf(const ProcessRun& run, const std::string& command) {
    std::vector<Json> reports = objectsOf(run.out);
    if (reports.empty()) throw Error(command, "expected a JSON report on standard output");
    return reports;
}

Json reportOf(const ProcessRun& run, const std::string& command) { return reportsOf(run, command).front(); }

std::map<std::string, double> stagesOf(const ProcessRun& run) {
    std::map<std::string, double> stages;
    for (const Json& report : objectsOf(run.out))
        if (const auto seconds = report.find("seconds"); seconds != report.end() && seconds->is_object()) {
            for (const auto& [stage, value] : seconds->items())
                if (value.is_number()) stages[stage] += value.get<double>();
        } else {
            for (const auto& [field, stage] : {std::pair{"readSeconds", "read"}, {"solveSeconds", "solve"}})
                if (const auto value = report.find(field); value != report.end() && value->is_number())
                    stages[stage] += value->get<double>();
        }
    double rest = run.seconds;
    for (const auto& [stage, value] : stages) rest -= value;
    stages["other"] = std::max(0.0, rest);
    return stages;
}

std::string failureOf(const ProcessRun& run) {
    std::string text = run.err;
    text.erase(text.find_last_not_of(" \n") + 1);
    std::size_t start = text.rfind('\n');
    if (run.exitCode == 2 && start != std::string::npos) {  // of bad usage the last line names only --help
        text.erase(start);
        start = text.rfind('\n');
    }
    if (start != std::string::npos) text = text.substr(start + 1);
    return "exit code " + std::to_string(run.exitCode) + (text.empty() ? "" : ": " + printable(text));
}

}  // namespace vlx
