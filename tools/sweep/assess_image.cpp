#include "sweep/assess_image.h"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "process/child_process.h"
#include "sweep/sweep_command.h"
#include "variolux/base/error.h"
#include "variolux/compare/colour_image.h"
#include "variolux/compare/reliability.h"

namespace vlx {

namespace {

/// Files that go when it goes.
struct TemporaryFiles {
    std::vector<std::string> paths;
    ~TemporaryFiles() {
        std::error_code ignored;
        for (const std::string& path : paths) std::filesystem::remove(path, ignored);
    }
    std::string add(const std::string& path) {
        paths.push_back(path);
        return path;
    }
};

}  // namespace

std::map<std::string, double> assessedErrors(const SweepPlan& plan, const std::string& command,
                                             const std::string& dump, const std::string& image,
                                             const std::string& stem) {
    TemporaryFiles files;
    std::string halves;
    bool whole = true;
    for (const std::string parity : {"even", "odd"}) {
        const std::string half = files.add(stem + "." + parity + ".exr"),
                          denoised = files.add(stem + "." + parity + ".image.exr");
        const ProcessRun divided =
            runCommand(plan.executable("vlx-pack subset " + shellQuoted(dump) + " --half " + parity +
                                       " --overwrite -q -o " + shellQuoted(half)));
        whole = whole && divided.exitCode == 0 &&
                runCommand(plan.executable(filled(
                               command, {{"input", shellQuoted(half)}, {"output", shellQuoted(denoised)}})))
                        .exitCode == 0 &&
                std::filesystem::exists(denoised);
        halves += (halves.empty() ? "" : ",") + denoised;
    }
    const std::string map = files.add(stem + ".map.exr");
    const auto assess = [&](const std::string& more) {
        return runCommand(plan.executable("vlx-krige " + shellQuoted(dump) + " --assess " +
                                          shellQuoted(image) + more + " --json -q --threads " +
                                          std::to_string(plan.options.threads) + " -o " + shellQuoted(map)));
    };
    ProcessRun run = assess(whole ? " --assess-halves " + shellQuoted(halves) : "");
    if (run.exitCode != 0 && whole) run = assess("");
    if (run.exitCode != 0) {
        while (run.err.ends_with('\n')) run.err.pop_back();
        throw Error("", "vlx-krige --assess cannot judge its image: " + run.err);
    }
    const auto report = reportOf(run, "vlx-krige --assess");
    const PredictedError predicted =
        predictedError(readColour(image).colour, readColour(map, "stddev").colour, image);
    return {{"predicted_relmse", report.at("relMse")},
            {"assessed_low", report.at("low")},
            {"assessed_high", report.at("high")},
            {"assessed_by_halves", report.at("validated").get<bool>() ? 1 : 0},
            {"predicted_rmse", predicted.rmse}};
}

}  // namespace vlx
