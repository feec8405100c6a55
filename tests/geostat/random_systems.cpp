// random_systems [COUNT [SEED [DIGITS]]]: COUNT random kriging systems (default 2000) of 16 to 256 data with
// condition numbers up to 1e16 and beyond: nothing may crash, be non-finite, or have a negative variance.
// Each is solved in double and in single precision, with up to DIGITS decimal digits (default 400; 16: none
// but double's). Prints how often each fallback was taken; exit 1 if anything was wrong.
#include <array>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>

#include "random_problem.h"

namespace {

using namespace vlx;
using Eigen::Index;

struct Counts {
    std::map<std::string, long> fallbacks;
    std::array<long, 20> condition{};  // by power of ten
    long wrong = 0;
};

/// What is wrong with an answer, or nothing.
std::string fault(const KrigingReport& report, const KrigingPrediction& p) {
    if (!report.ok()) return "refused: " + report.message;
    for (Index t = 0; t < p.estimate.rows(); ++t) {
        if (p.status[static_cast<std::size_t>(t)] == TargetStatus::InvalidTarget)
            return "a valid target was refused";
        if (!p.estimate.row(t).allFinite() || !std::isfinite(p.variance[t]) || !p.weights.row(t).allFinite())
            return "not finite";
        if (p.variance[t] < 0) return "negative variance";
    }
    return {};
}

void count(Counts& counts, const KrigingReport& report, const KrigingPrediction& p) {
    const auto note = [&](const std::string& name, bool taken) { counts.fallbacks[name] += taken ? 1 : 0; };
    note("coincident data merged", report.merged > 0);
    note("generalised covariance", report.generalisedCovariance);
    note("jitter", report.jitter > 0);
    note("jitter above rounding (indefinite)", report.indefinite);
    note("dependent drift columns dropped", report.droppedDrift > 0);
    note("single-precision factor used", report.singlePrecision);
    bool notEstimable = false;
    for (const TargetStatus s : p.status) notEstimable |= s == TargetStatus::NotEstimable;
    note("a target's drift not estimable", notEstimable);
    note("more digits", p.moreDigits > 0);
    note("more digits: " + std::to_string(p.digits), p.moreDigits > 0);
    bool inaccurate = false;
    for (const TargetStatus s : p.status) inaccurate |= s == TargetStatus::Inaccurate;
    note("a target flagged inaccurate", inaccurate);
    note("a variance clamped at 0", p.lowestVariance < 0);
    const double power = std::floor(std::log10(std::max(1.0, report.conditionEstimate)));
    ++counts.condition[static_cast<std::size_t>(std::min(19.0, power))];
}

}  // namespace

int main(int argc, char** argv) {
    const long systems = argc > 1 ? std::atol(argv[1]) : 2000;
    const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
    const int digits = argc > 3 ? std::atoi(argv[3]) : KrigingAccuracy{}.mostDigits;
    if (argc > 4 || systems < 1) {
        std::cerr << "usage: random_systems [COUNT [SEED [DIGITS]]]\n";
        return 2;
    }
    testing::RandomProblemOptions options;
    options.fewestData = 16;
    options.mostData = 256;
    options.hard = true;
    Counts perPrecision[2];
    const char* names[2] = {"double", "single"};
    for (long k = 0; k < systems; ++k) {
        testing::Random random(seed * 1000003 + static_cast<std::uint64_t>(k));
        testing::RandomProblem r = testing::randomProblem(random, options);
        r.problem.accuracy.mostDigits = digits;
        for (int precision = 0; precision < 2; ++precision) {
            r.problem.precision = precision == 0 ? KrigingPrecision::Double : KrigingPrecision::Single;
            const KrigingSystem system(r.problem);
            KrigingPredictOptions predict;
            predict.weights = true;
            const KrigingPrediction p = system.predict(r.targets, predict);
            count(perPrecision[precision], system.report(), p);
            const std::string wrong = fault(system.report(), p);
            if (wrong.empty()) continue;
            ++perPrecision[precision].wrong;
            std::cout << "system " << k << " (" << names[precision] << "): " << wrong << '\n';
        }
    }
    for (int precision = 0; precision < 2; ++precision) {
        std::cout << names[precision] << ": " << systems << " systems\n";
        for (const auto& [name, times] : perPrecision[precision].fallbacks)
            std::cout << "  " << name << ": " << times << '\n';
        std::cout << "  condition estimates by power of ten:";
        for (const long c : perPrecision[precision].condition) std::cout << ' ' << c;
        std::cout << '\n';
    }
    const long wrong = perPrecision[0].wrong + perPrecision[1].wrong;
    std::cout << 2 * systems - wrong << " passed, " << wrong << " failed\n";
    return wrong > 0 ? 1 : 0;
}
