#include <Eigen/QR>
#include <cmath>
#include <cstdio>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "csv.h"
#include "oracle.h"
#include "variolux/geostat/empirical_variogram.h"
#include "variolux/geostat/variogram_fit.h"
#include "variolux/geostat/variogram_model.h"

namespace {

using vlx::StructureType;
using vlx::testing::CsvTable;

/// "x" or "sqrt(x)".
Eigen::VectorXd term(const CsvTable& data, const std::string& name) {
    if (name.rfind("sqrt(", 0) == 0) return data.numbers(name.substr(5, name.size() - 6)).cwiseSqrt();
    return data.numbers(name);
}

/// A column, or "ols-residual of z~a+b".
Eigen::VectorXd variable(const CsvTable& data, const std::string& name) {
    const std::string prefix = "ols-residual of ";
    if (name.rfind(prefix, 0) != 0) return data.numbers(name);
    const std::size_t tilde = name.find('~');
    const Eigen::VectorXd z = data.numbers(name.substr(prefix.size(), tilde - prefix.size()));
    std::vector<Eigen::VectorXd> terms{Eigen::VectorXd::Ones(z.size())};
    for (std::size_t at = tilde + 1; at < name.size();) {
        const std::size_t end = std::min(name.find('+', at), name.size());
        const Eigen::VectorXd t = term(data, name.substr(at, end - at));
        terms.push_back(t.array() - t.mean());
        at = end + 1;
    }
    Eigen::MatrixXd design(z.size(), static_cast<Eigen::Index>(terms.size()));
    for (std::size_t t = 0; t < terms.size(); ++t) design.col(static_cast<Eigen::Index>(t)) = terms[t];
    return z - design * design.colPivHouseholderQr().solve(z);
}

bool near(double value, double exact, double relative) {
    return std::abs(value - exact) <= relative * std::abs(exact);
}

void count(OracleCount& counts, bool passed, const std::string& what) {
    ++(passed ? counts.passed : counts.failed);
    if (!passed) std::printf("FAILED %s\n", what.c_str());
}

vlx::VariogramModel modelOf(const std::string& code, double nugget, double sill, double range, double kappa) {
    static const std::map<std::string, StructureType> types = {
        {"Sph", StructureType::Spherical}, {"Exp", StructureType::Exponential},
        {"Gau", StructureType::Gaussian},  {"Exc", StructureType::Stable},
        {"Mat", StructureType::Matern},    {"Ste", StructureType::Matern},
        {"Lin", StructureType::Linear}};
    // Stein's Matern: u = 2 sqrt(kappa) h / a.
    if (code == "Ste") range /= 2 * std::sqrt(kappa);
    return {nugget, {{types.at(code), sill, range, kappa}}};
}

OracleCount runEmpirical(const std::string& dir) {
    const CsvTable table(dir + "/empirical_variograms_exact.csv");
    std::map<std::pair<std::string, std::string>, std::vector<std::size_t>> groups;
    for (std::size_t i = 0; i < table.size(); ++i)
        groups[{table.text(i, "dataset") + "," + table.text(i, "variable"), table.text(i, "estimator")}]
            .push_back(i);
    OracleCount counts;
    for (const auto& [key, rows] : groups) {
        const CsvTable data(dir + "/" + table.text(rows[0], "dataset") + "_data.csv");
        Eigen::MatrixXd positions(static_cast<Eigen::Index>(data.size()), 2);
        positions << data.numbers("x"), data.numbers("y");
        const Eigen::VectorXd z = variable(data, table.text(rows[0], "variable"));
        for (const std::size_t row : rows) {
            // One class at a time: rows may be any subset of a variogram's.
            vlx::EmpiricalVariogramOptions options;
            options.edges = {table.number(row, "lower"), table.number(row, "upper")};
            const std::string& estimator = table.text(row, "estimator");
            const double n = table.number(row, "np");
            double factor = 1;
            if (estimator == "dowd") options.estimator = vlx::VariogramEstimator::Dowd;
            if (estimator.rfind("cressie-hawkins", 0) == 0)
                options.estimator = vlx::VariogramEstimator::CressieHawkins;
            if (estimator == "cressie-hawkins-gstat")  // without the last term of the bias correction
                factor = (0.457 + 0.494 / n + 0.045 / (n * n)) / (0.457 + 0.494 / n);
            const vlx::VariogramBin bin = vlx::empiricalVariogram(positions, z, options).bins[0];
            const double gamma = table.number(row, "gamma");
            const bool passed = bin.pairs == n && near(bin.distance, table.number(row, "dist"), 1e-12) &&
                                near(bin.semivariance * factor, gamma, 1e-11);
            count(counts, passed,
                  "variogram " + key.first + "," + estimator + " class up to " + table.text(row, "upper") +
                      ": expected " + table.text(row, "gamma") + ", found " +
                      std::to_string(bin.semivariance * factor));
        }
    }
    return counts;
}

OracleCount runCurves(const std::string& dir) {
    const CsvTable models(dir + "/models.csv"), curves(dir + "/model_curves_gstat.csv");
    std::map<std::string, vlx::VariogramModel> byName;
    for (std::size_t i = 0; i < models.size(); ++i)
        byName[models.text(i, "dataset") + "," + models.text(i, "model")] =
            modelOf(models.text(i, "gstat_code"), models.number(i, "nugget"), models.number(i, "psill"),
                    models.number(i, "range"), models.number(i, "kappa"));
    OracleCount counts;
    for (std::size_t i = 0; i < curves.size(); ++i) {
        const std::string name = curves.text(i, "dataset") + "," + curves.text(i, "model");
        const double h = curves.number(i, "h"), gamma = vlx::semivariance(byName.at(name), h);
        // gstat itself rounds sill - covariance and has a Bessel function of 1e-9.
        count(counts, std::abs(gamma - curves.number(i, "gamma")) <= 1e-9 * byName.at(name).sill(),
              "model " + name + " at h = " + curves.text(i, "h"));
    }
    return counts;
}

/// The model whose gamma gives the weights of fit_method 2. The tables do not state it; these are the round
/// numbers that make every such row of the table stationary and its SSE right to eight digits.
vlx::VariogramModel initialModel(const std::string& dataset, const std::string& variable,
                                 const std::string& code, double kappa) {
    double nugget = 0.3, sill = 2, range = 40;
    if (dataset == "meuse") nugget = 0.1, sill = 0.5, range = 900;
    if (dataset == "meuse" && variable != "z") nugget = 0.05, sill = 0.15, range = 700;
    if (code == "Exp") range /= 3;
    if (code == "Gau") range *= 0.55;
    if (code == "Exc") range *= 0.4;
    if (code == "Mat") range *= kappa == 0.5 ? 1.0 / 3 : kappa == 1.5 ? 0.22 : 0.18;
    if (code == "Ste") range *= 0.5;
    return modelOf(code, nugget, sill, range, kappa);
}

OracleCount runFits(const std::string& dir) {
    const CsvTable fits(dir + "/fits_exact.csv"), table(dir + "/empirical_variograms_exact.csv");
    std::map<std::string, vlx::EmpiricalVariogram> variograms;
    std::map<std::string, double> longest;
    for (std::size_t i = 0; i < table.size(); ++i) {
        if (table.text(i, "estimator") != "matheron") continue;
        const std::string key = table.text(i, "dataset") + "," + table.text(i, "variable");
        variograms[key].bins.push_back({table.number(i, "lower"), table.number(i, "upper"),
                                        table.number(i, "np"), table.number(i, "dist"),
                                        table.number(i, "gamma"), 0, 0});
        longest[key] = std::max(longest[key], table.number(i, "dist"));
    }
    OracleCount counts;
    for (std::size_t i = 0; i < fits.size(); ++i) {
        const std::string &dataset = fits.text(i, "dataset"), &name = fits.text(i, "variable");
        std::string code = fits.text(i, "code");
        const double kappa = fits.number(i, "kappa");
        const bool freeAlpha = code == "Exc_free_alpha";
        if (freeAlpha) code = "Exc";
        const vlx::VariogramModel unit = modelOf(code, 0, 1, 20 * longest[dataset + "," + name], kappa);
        vlx::FitOptions options;
        options.structures = {{unit.structures[0].type, 0, unit.structures[0].range, kappa, kappa}};
        if (freeAlpha) options.structures[0].minShape = 1e-3, options.structures[0].maxShape = 2;
        switch (std::stoi(fits.text(i, "fit_method"))) {
            case 1:
                options.weights = vlx::FitWeights::Pairs;
                break;
            case 2:
                options.weights = vlx::FitWeights::PairsPerSquaredReference;
                options.reference = initialModel(dataset, name, code, kappa);
                break;
            case 6:
                options.weights = vlx::FitWeights::Equal;
                break;
            case 7:
                options.weights = vlx::FitWeights::PairsPerSquaredDistance;
                break;
            default:
                throw std::runtime_error("fits_exact.csv: unknown fit_method " + fits.text(i, "fit_method"));
        }
        const vlx::EmpiricalVariogram& variogram = variograms[dataset + "," + name];
        const vlx::VariogramFit fit = vlx::fitVariogram(variogram, options);
        // The sum of squares of the returned model by its definition: what the fit says must be true.
        double sse = 0;
        for (const vlx::VariogramBin& bin : variogram.bins) {
            const double h = bin.distance, residual = bin.semivariance - vlx::semivariance(fit.model, h);
            double weight = options.weights == vlx::FitWeights::Equal ? 1 : bin.pairs;
            if (options.weights == vlx::FitWeights::PairsPerSquaredDistance) weight /= h * h;
            if (options.weights == vlx::FitWeights::PairsPerSquaredReference)
                weight /= std::pow(vlx::semivariance(options.reference, h), 2);
            sse += weight * residual * residual;
        }
        const double exact = fits.number(i, "SSErr");
        count(counts,
              fit.status == vlx::FitStatus::Ok && !fit.model.validate() && sse <= exact * (1 + 1e-6) &&
                  near(fit.sse, sse, 1e-9),
              "fit " + dataset + "," + name + "," + fits.text(i, "weights") + "," + fits.text(i, "code") +
                  " kappa " + fits.text(i, "kappa") + ": SSE at most " + fits.text(i, "SSErr") + ", found " +
                  std::to_string(sse) + " (" + fit.message() + ")");
    }
    return counts;
}

}  // namespace

OracleCount runVariography(const std::string& dir) {
    OracleCount total;
    for (const auto& [name, run] : {std::pair{"empirical variograms", &runEmpirical},
                                    std::pair{"model curves", &runCurves}, std::pair{"fits", &runFits}}) {
        const OracleCount counts = run(dir);
        std::printf("%s: %d passed, %d failed\n", name, counts.passed, counts.failed);
        total.passed += counts.passed;
        total.failed += counts.failed;
    }
    return total;
}
