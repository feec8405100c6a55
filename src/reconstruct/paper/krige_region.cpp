#include "reconstruct/paper/krige_region.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "reconstruct/common/inspection.h"
#include "reconstruct/common/picture_scale.h"
#include "variolux/base/error.h"
#include "variolux/base/parallel.h"
#include "variolux/geostat/kriging.h"
#include "variolux/geostat/lattice_variogram.h"
#include "variolux/geostat/variogram_fit.h"

namespace vlx {

namespace {

constexpr int kColours = 3;  // R, G, B carry the variogram
constexpr int kMinData = 3;  // a variogram needs two distances
constexpr int kDistanceClasses = 12;
constexpr int kMostCells = 5;          // for each datum: up to here the lattice's variogram is quicker
constexpr double kMinExponent = 0.25;  // lower ones are a nugget in all but name

/// A pixel's samples are as many as an adaptive sampler saw fit: they must not outweigh its neighbours'.
Eigen::VectorXd pixelWeights(const RegionData& data) {
    Eigen::VectorXd samples = Eigen::VectorXd::Zero(data.pixels.pixels());
    for (Eigen::Index i = 0; i < data.size(); ++i) samples[data.pixelOf(i)] += data.counts[i];
    Eigen::VectorXd weights(data.size());
    for (Eigen::Index i = 0; i < data.size(); ++i) weights[i] = data.counts[i] / samples[data.pixelOf(i)];
    return weights / weights.sum();
}

/// What a region's data say before any kriging.
struct Moments {
    Eigen::VectorXd weights;  // n, sum 1: every pixel with data counts the same, in it every sample
    Eigen::RowVectorXd mean;  // c: arithmetic mean
    Eigen::VectorXd errors;   // n: error variance of each datum, summed over R, G, B
    Eigen::Array3d spread;    // variance between the data, a colour
    double signal = 0;        // spread less errors, summed over colours, >= 0

    explicit Moments(const RegionData& data)
        : weights(pixelWeights(data)),
          mean(weights.transpose() * data.means),
          errors(data.errorVariances.leftCols(kColours).rowwise().sum()),
          spread((data.means.leftCols(kColours).rowwise() - mean.head(kColours))
                     .colwise()
                     .squaredNorm()
                     .transpose()
                     .array() /
                 static_cast<double>(data.size())),
          signal(std::max(0.0, spread.sum() - errors.mean())) {}
};

/// RGB of each pixel's first estimate, as a difference from the region's mean (see krigeRegion, 3).
Eigen::MatrixXd firstEstimates(const RegionData& data, const Moments& moments) {
    const auto pixels = static_cast<Eigen::Index>(data.pixels.pixels());
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(pixels, kColours);
    Eigen::VectorXd count = Eigen::VectorXd::Zero(pixels), error = count;
    for (Eigen::Index i = 0; i < data.size(); ++i) {
        const int pixel = data.pixelOf(i);
        sum.row(pixel) += data.counts[i] * (data.means.row(i) - moments.mean).head(kColours);
        count[pixel] += data.counts[i];
        error[pixel] += data.counts[i] * data.counts[i] * moments.errors[i];
    }
    for (Eigen::Index p = 0; p < pixels; ++p) {
        if (count[p] == 0) continue;  // no estimate of its own: the region's mean, difference zero
        const double noise = error[p] / (count[p] * count[p]);
        const double share = moments.signal > 0 ? moments.signal / (moments.signal + noise) : 0;
        sum.row(p) *= share / count[p];
    }
    return sum;
}

/// Composite coordinates: position, then the scaled colour difference; only the position when k is 0.
Eigen::MatrixXd composite(const Eigen::MatrixXd& positions, const Eigen::MatrixXd& colours, double k) {
    if (k == 0) return positions;
    Eigen::MatrixXd joined(positions.rows(), 2 + kColours);
    joined << positions, k * colours;
    return joined;
}

KrigingProblem problemOf(const RegionData& data, const VariogramModel& model, const Moments& moments,
                         const Eigen::MatrixXd& differences, double k) {
    KrigingProblem problem;
    problem.model = model;
    problem.positions = composite(data.positions, differences, k);
    problem.values = data.means;
    problem.errorVariances = moments.errors;
    return problem;
}

/// Each pixel is the mean of its cells, at their centres, with the pixel's colour. The nugget is variation
/// between cells, which a cell of the pixel shares with its datum.
KrigingTargets pixelTargets(const RegionData& data, const Eigen::MatrixXd& pixelColours, double k) {
    const auto pixels = static_cast<Eigen::Index>(data.pixels.pixels());
    const int cells = data.cellsPerPixel, perPixel = cells * cells;
    Eigen::MatrixXd positions(pixels * perPixel, 2), colours(pixels * perPixel, kColours);
    KrigingTargets targets;
    targets.cellAxes = 2;
    for (Eigen::Index p = 0; p < pixels; ++p) {
        targets.begin.push_back(p * perPixel);
        const double left = data.pixels.x + static_cast<double>(p % data.pixels.width);
        const double top = data.pixels.y + static_cast<double>(p / data.pixels.width);
        for (int cell = 0; cell < perPixel; ++cell)
            positions.row(p * perPixel + cell) << left + (cell % cells + 0.5) / cells,
                top + (cell / cells + 0.5) / cells;
        colours.middleRows(p * perPixel, perPixel).rowwise() = pixelColours.row(p);
    }
    targets.begin.push_back(pixels * perPixel);
    targets.points = composite(positions, colours, k);
    return targets;
}

/// Rows and columns of cells.
Lattice latticeOf(const RegionData& data) {
    return {Eigen::Index{data.pixels.width} * data.cellsPerPixel,
            Eigen::Index{data.pixels.height} * data.cellsPerPixel, 1.0 / data.cellsPerPixel};
}

/// The cells of the lattice that the data lie in; empty if they are not, one by one, at centres of cells.
std::vector<Eigen::Index> cellsOf(const RegionData& data, const Lattice& lattice) {
    std::vector<Eigen::Index> cells;
    for (Eigen::Index i = 0; i < data.size(); ++i) {
        const double x = (data.positions(i, 0) - data.pixels.x) / lattice.spacing - 0.5;
        const double y = (data.positions(i, 1) - data.pixels.y) / lattice.spacing - 0.5;
        const bool centre = x == std::floor(x) && x >= 0 && x < static_cast<double>(lattice.width) &&
                            y == std::floor(y) && y >= 0 && y < static_cast<double>(lattice.height);
        const Eigen::Index cell =
            centre ? static_cast<Eigen::Index>(y) * lattice.width + static_cast<Eigen::Index>(x) : -1;
        if (cell < 0 || (i > 0 && cell <= cells.back())) return {};
        cells.push_back(cell);
    }
    return cells;
}

/// Section 4: the empirical variogram of the cell means, less their noise, in classes up to the region's
/// diagonal (a singular value lies beyond it, and is left out). `judged`: with standard errors.
EmpiricalVariogram variogramOf(const RegionData& data, const Eigen::MatrixXd& colours,
                               const Eigen::VectorXd& errors, bool judged) {
    EmpiricalVariogramOptions classes;
    classes.edges = uniformEdges(std::hypot(data.pixels.width, data.pixels.height), kDistanceClasses);
    const Lattice lattice = latticeOf(data);
    // A lattice that is nearly empty takes longer than its data.
    if (!judged && lattice.width * lattice.height <= kMostCells * data.size())
        if (const std::vector<Eigen::Index> cells = cellsOf(data, lattice); !cells.empty())
            return latticeVariogram(lattice, cells, colours, classes.edges, errors);
    return empiricalVariogram(data.positions, colours, classes, errors);
}

/// The stable model fitted to it; near the origin it matters most, hence the weights.
VariogramFit fitStableModel(const EmpiricalVariogram& variogram, bool nugget) {
    FitOptions options;
    options.structures = {{.type = StructureType::Stable, .minShape = kMinExponent, .maxShape = 2}};
    options.nugget = nugget;
    options.weights = FitWeights::PairsPerSquaredDistance;
    options.search = FitSearch::Fast;
    options.sillTest = false;  // whether there is structure, the sill tells
    return fitVariogram(variogram, options);
}

/// RegionEstimate::agreed, of one pixel or of all, given the weights of the data (pixels x n).
Eigen::MatrixXd agreedShare(const RegionData& data, const Eigen::MatrixXd& weights) {
    const Eigen::MatrixXd share = weights.array().square().matrix() * data.counts.cwiseInverse().asDiagonal();
    Eigen::MatrixXd agreed(weights.rows(), kColours);
    for (int c = 0; c < kColours; ++c) {
        const double level2 = data.means.col(c).squaredNorm() / data.size();
        const Eigen::ArrayXd ofSample = data.errorVariances.col(c).array() * data.counts.array();
        const double most = data.varianceKnown
                                ? kAgreement * kAgreement * level2
                                : unseenVariance(static_cast<double>(data.samples), std::sqrt(level2));
        const Eigen::ArrayXd agree = (ofSample <= most).cast<double>();
        agreed.col(c) = share * agree.matrix();
    }
    return agreed;
}

/// The region's arithmetic mean everywhere; its error from the samples' noise and what the data vary about
/// it.
void useMean(RegionEstimate& estimate, const RegionData& data, const Moments& moments,
             RegionOutcome outcome) {
    estimate.diagnostics.outcome = outcome;
    estimate.values.rowwise() = moments.mean;
    estimate.agreed = agreedShare(data, moments.weights.transpose()).replicate(estimate.values.rows(), 1);
    const Eigen::RowVectorXd noise =
        moments.weights.array().square().matrix().transpose() * data.errorVariances;
    for (int c = 0; c < kColours; ++c) {
        const double signal = std::max(0.0, moments.spread[c] - data.errorVariances.col(c).mean());
        estimate.stddev.col(c).setConstant(
            std::sqrt(noise[c] + (outcome == RegionOutcome::NoStructure ? 0 : signal)));
    }
}

/// Splits each target's kriging variance, which is for the sum of the colours, between them: the noise part
/// by the weights exactly, the rest like the data's own variation.
void colourErrors(RegionEstimate& estimate, const RegionData& data, const Moments& moments,
                  const KrigingPrediction& prediction) {
    const Eigen::MatrixXd noise =
        prediction.weights.array().square().matrix() * data.errorVariances.leftCols(kColours);
    const double spread = moments.spread.sum();
    for (int c = 0; c < kColours; ++c) {
        const double share = spread > 0 ? moments.spread[c] / spread : 1.0 / kColours;
        for (Eigen::Index p = 0; p < estimate.values.rows(); ++p) {
            const double signal = std::max(0.0, prediction.variance[p] - noise.row(p).sum()) * share;
            estimate.stddev(p, c) = std::sqrt(signal + noise(p, c));
        }
    }
}

}  // namespace

RegionEstimate krigeRegion(const RegionData& data, const Paper& options, bool inspect) {
    const Eigen::Index pixels = data.pixels.pixels();
    RegionEstimate estimate;
    estimate.values = Eigen::MatrixXd::Zero(pixels, data.means.cols());
    estimate.stddev = Eigen::MatrixXd::Zero(pixels, data.means.cols());
    estimate.agreed = Eigen::MatrixXd::Zero(pixels, kColours);
    RegionDiagnostics& diagnostics = estimate.diagnostics;
    diagnostics.pixels = data.pixels;
    diagnostics.data = data.size();
    diagnostics.samples = data.samples;
    if (inspect) estimate.inspection.neighbourhood = data.pixels;
    if (data.size() == 0) return estimate;  // RegionOutcome::Empty

    const Moments moments(data);
    diagnostics.errorVariance = moments.errors.dot(data.counts) / data.size();
    const bool equal = (data.means.rowwise() - data.means.row(0)).cwiseAbs().maxCoeff() == 0;
    if (equal && diagnostics.errorVariance == 0 &&
        data.samples > 1) {  // one sample equals itself, and proves nothing
        useMean(estimate, data, moments, RegionOutcome::AllEqual);
        return estimate;
    }
    if (data.size() < kMinData) {
        useMean(estimate, data, moments, RegionOutcome::TooFewData);
        return estimate;
    }

    const double spread = moments.spread.sum();
    const double k = options.colourDistance && spread > 0 ? moments.signal / spread / std::sqrt(spread) : 0;
    diagnostics.colourScale = k;
    const Eigen::MatrixXd differences = data.means.leftCols(kColours).rowwise() - moments.mean.head(kColours);

    // Samples of the whole image with unknown errors are taken to be exact: nothing is filtered out.
    const bool exact = options.regionSize == 0 && !data.varianceKnown;
    const EmpiricalVariogram variogram = variogramOf(data, differences, moments.errors, false);
    const VariogramFit fit = fitStableModel(variogram, !exact);
    if (inspect) {
        RegionInspection& inspection = estimate.inspection;
        inspection.distance = "distance on the image plane, pixels";
        setVariogram(inspection, variogramOf(data, differences, moments.errors, true), data.positions,
                     differences, moments.errors);
        if (fit.ok()) inspection.model = fit.model;
        if (!fit.ok()) inspection.fallbacks.push_back(fit.message());
        if (fit.rangeAtBound) inspection.fallbacks.emplace_back("the range is at the bound of its search");
    }
    if (!fit.ok() && fit.status != FitStatus::Zero) {
        useMean(estimate, data, moments, RegionOutcome::FitFailed);
        return estimate;
    }
    if (fit.status == FitStatus::Zero || fit.model.sill() == 0) {
        useMean(estimate, data, moments, RegionOutcome::NoStructure);
        return estimate;
    }
    if (!data.varianceKnown && diagnostics.errorVariance == 0 && fit.model.nugget > 0) {
        // One sample a cell: what does not correlate with its neighbours is taken for noise.
        RegionData noisy = data;
        noisy.errorVariances.leftCols(kColours).rowwise() =
            (fit.model.nugget / spread * moments.spread).matrix().transpose();
        return krigeRegion(noisy, options, inspect);
    }
    diagnostics.nugget = fit.model.nugget;
    diagnostics.sill = fit.model.structures.front().sill;
    diagnostics.range = fit.model.structures.front().range;
    diagnostics.exponent = fit.model.structures.front().shape;

    // More digits would take some thousand times as long: a pixel may be Inaccurate, and is counted.
    const KrigingSystem system = KrigingSystem::inDouble(problemOf(data, fit.model, moments, differences, k));
    diagnostics.condition = system.report().conditionEstimate;
    diagnostics.jitter = system.report().jitter;
    const KrigingPrediction prediction =
        system.predict(pixelTargets(data, firstEstimates(data, moments), k), {.weights = true});
    if (inspect) {
        estimate.inspection.crossValidation =
            crossValidate(system.leaveOneOut(), data.means.leftCols(kColours));
        if (!system.report().message.empty())
            estimate.inspection.fallbacks.push_back(system.report().message);
    }
    if (!system.report().ok() || !prediction.estimate.allFinite() || !prediction.variance.allFinite()) {
        useMean(estimate, data, moments, RegionOutcome::SolveFailed);
        return estimate;
    }
    diagnostics.outcome = RegionOutcome::Kriged;
    diagnostics.inaccurate = static_cast<int>(
        std::count(prediction.status.begin(), prediction.status.end(), TargetStatus::Inaccurate));
    estimate.values = prediction.estimate;
    estimate.agreed = agreedShare(data, prediction.weights);
    colourErrors(estimate, data, moments, prediction);
    return estimate;
}

}  // namespace vlx
