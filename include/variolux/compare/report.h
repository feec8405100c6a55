#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "variolux/compare/metrics.h"

namespace vlx {

/// One image of a report.
struct ReportEntry {
    std::string path;
    std::string name;                     ///< short, unique in the report: see shortNames
    std::array<std::string, 3> channels;  ///< what was compared
    Comparison comparison;
    std::optional<Calibration> calibration;
};

/// A limit on a metric that must not be passed.
struct Limit {
    Metric metric;
    double value;
};

/// A limit that an image passed. A metric that is not a number passes every limit: a check must not succeed
/// because there was nothing to compare.
struct Violation {
    std::string path;
    Limit limit;
    double found;
};

/// What `vlx-compare` prints.
struct Report {
    std::string reference;  ///< its path
    std::array<std::string, 3> referenceChannels;
    Window window;
    std::vector<ReportEntry> images;
    std::vector<Violation> violations;
};

/// File names without folder and extension; where two are equal, the paths as given.
std::vector<std::string> shortNames(const std::vector<std::string>& paths);

/// A limit from text "METRIC=VALUE"; the metric must be one that is better when lower (`higherIsBetter`
/// false) or higher (true). Throws Error naming what is wrong and the metrics there are.
Limit parseLimit(const std::string& text, bool higherIsBetter);

/// The limits that the report's images pass: a value above the limit, or below it for metrics that are better
/// when higher. Bias is judged by its magnitude.
std::vector<Violation> checkLimits(const Report& report, const std::vector<Limit>& limits);

/// One line: which image, metric, value and limit.
std::string describe(const Violation& violation);

/// A table for people: one row a metric, one column an image, '*' at the best value of a row where there is
/// more than one image; then what was excluded, in words.
std::string toText(const Report& report);

/// The same for machines: JSON with finite numbers only, null where a number is not finite or not defined
/// (psnr of equal images, ssim of tiny ones).
std::string toJson(const Report& report);

}  // namespace vlx
