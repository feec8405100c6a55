// hard_cases [DIR]: every kriging case of a folder (default testdata/hard) against its exact answer, in
// double and in single precision. One line a case; exit 1 if any failed.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>

#include "hard_case.h"

namespace {

using vlx::testing::HardCase;

const std::pair<vlx::KrigingPrecision, std::string> kPrecisions[] = {
    {vlx::KrigingPrecision::Double, ""}, {vlx::KrigingPrecision::Single, "single precision: "}};

struct Pair {
    const char* first;
    const char* second;
    double tolerance;
};

/// Cases that must agree with one another when both are present.
constexpr Pair kPairs[] = {{"h25a", "h25b", 1e-9},
                           {"h26a", "h26b", 1e-9},
                           {"h41", "h42", 1e-9},
                           {"h14a", "h14b", 1e-6},
                           {"h29", "h30", 1e-5}};

std::string prefix(const std::string& id) { return id.substr(0, id.find('_')); }

std::vector<std::string> comparePair(const HardCase& a, const HardCase& b, double tolerance) {
    const auto x = vlx::KrigingSystem(a.problem).predict(a.targets);
    const auto y = vlx::KrigingSystem(b.problem).predict(b.targets);
    const auto m = std::min(x.estimate.rows(), y.estimate.rows());
    std::vector<std::string> failures;
    const double estimate = (x.estimate.topRows(m) - y.estimate.topRows(m)).cwiseAbs().maxCoeff();
    if (!(estimate <= tolerance)) failures.push_back("estimates differ by " + std::to_string(estimate));
    const double variance = (x.variance.head(m) - y.variance.head(m)).cwiseAbs().maxCoeff();
    if (!(variance <= tolerance)) failures.push_back("variances differ by " + std::to_string(variance));
    return failures;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc > 2) {
        std::cerr << "usage: hard_cases [DIR]\n";
        return 2;
    }
    std::filesystem::path folder = argc == 2 ? argv[1] : VLX_TESTDATA;
    if (std::filesystem::is_directory(folder / "hard")) folder /= "hard";
    std::vector<std::filesystem::path> paths;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error))
        if (entry.path().extension() == ".json") paths.push_back(entry.path());
    if (error) {
        std::cerr << folder.string() << ": " << error.message() << '\n';
        return 1;
    }
    std::sort(paths.begin(), paths.end());

    int passed = 0, failed = 0;
    const auto report = [&](const std::string& name, const std::vector<std::string>& failures) {
        ++(failures.empty() ? passed : failed);
        std::cout << (failures.empty() ? "pass  " : "FAIL  ") << name << '\n';
        for (const std::string& failure : failures) std::cout << "        " << failure << '\n';
    };
    std::map<std::string, HardCase> cases;
    for (const auto& path : paths) {
        try {
            const HardCase hardCase = vlx::testing::readHardCase(path.string());
            std::vector<std::string> failures;
            for (const auto& [precision, name] : kPrecisions)
                for (const std::string& failure : vlx::testing::checkHardCase(hardCase, precision))
                    failures.push_back(name + failure);
            report(hardCase.id, failures);
            cases[prefix(hardCase.id)] = hardCase;
        } catch (const std::exception& problem) {
            report(path.filename().string(), {problem.what()});
        }
    }
    for (const Pair& pair : kPairs) {
        const auto a = cases.find(pair.first), b = cases.find(pair.second);
        if (a == cases.end() || b == cases.end()) continue;
        report(std::string(pair.first) + " = " + pair.second,
               comparePair(a->second, b->second, pair.tolerance));
    }
    std::cout << passed << " passed, " << failed << " failed\n";
    return failed > 0 || passed == 0 ? 1 : 0;
}
