#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <tuple>

#include "csv.h"
#include "oracle.h"
#include "variolux/geostat/kriging.h"

namespace {

using namespace vlx;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::CsvTable;

enum class Block { None, GstatNodes, GaussLegendre, Midpoints };

/// A method name of the tables ("OK_Err_mevar", "KED_trend", "SK_block_midpoint16", ...), taken apart.
struct Method {
    std::string base;       // SK, OK, KM, UK, KED
    double errorShare = 0;  // of the nugget that is a measurement error; the rest stays with the field
    bool noNugget = false;
    bool errorVariances = false;
    bool trend = false;
    Block block = Block::None;
    Index nearest = 0;
};

Method parse(const std::string& name) {
    Method method;
    std::size_t begin = 0;
    while (begin <= name.size()) {
        const std::size_t end = std::min(name.find('_', begin), name.size());
        const std::string token = name.substr(begin, end - begin);
        if (begin == 0)
            method.base = token;
        else if (token == "xy") {
        } else if (token == "Err")
            method.errorShare = 1;
        else if (token.starts_with("Nug."))
            method.errorShare = 1 - std::stod(token.substr(3));
        else if (token.starts_with("Err."))
            method.errorShare = std::stod(token.substr(3));
        else if (token == "mevar")
            method.errorVariances = true;
        else if (token == "nonug")
            method.noNugget = true;
        else if (token == "trend")
            method.trend = true;
        else if (token == "block")
            method.block = Block::GstatNodes;
        else if (token == "gauss4exact")
            method.block = Block::GaussLegendre;
        else if (token == "midpoint16")
            method.block = Block::Midpoints;
        else if (token.starts_with("nmax"))
            method.nearest = std::stol(token.substr(4));
        else
            throw std::runtime_error("unknown method " + name);
        begin = end + 1;
    }
    return method;
}

VariogramModel readModel(const CsvTable& models, const std::string& dataset, const std::string& name) {
    for (std::size_t i = 0; i < models.size(); ++i) {
        if (models.text(i, "dataset") != dataset || models.text(i, "model") != name) continue;
        const std::string code = models.text(i, "gstat_code");
        const double kappa = models.number(i, "kappa");
        VariogramStructure s;
        s.sill = models.number(i, "psill");
        s.range = models.number(i, "range");
        if (code == "Sph") s.type = StructureType::Spherical;
        if (code == "Exp") s.type = StructureType::Exponential;
        if (code == "Gau") s.type = StructureType::Gaussian;
        if (code == "Exc") s.type = StructureType::Stable, s.shape = kappa;
        if (code == "Mat") s.type = StructureType::Matern, s.shape = kappa;
        if (code == "Ste") {  // Matern with u = 2 sqrt(kappa) h / range
            s.type = StructureType::Matern;
            s.shape = kappa;
            s.range /= 2 * std::sqrt(kappa);
        }
        return {models.number(i, "nugget"), {s}};
    }
    throw std::runtime_error("no model " + name + " for " + dataset);
}

struct Dataset {
    CsvTable data, targets;
    double mean = 0, blockSize = 0;
    bool synthetic = false;

    Dataset(const std::string& folder, const std::string& name)
        : data(folder + "/" + name + "_data.csv"), targets(folder + "/" + name + "_targets.csv") {
        synthetic = name == "synth";
        mean = synthetic ? 10.5 : 5.9;
        blockSize = synthetic ? 12 : 200;
    }

    static MatrixXd positions(const CsvTable& table) {
        MatrixXd out(static_cast<Index>(table.size()), 2);
        out << table.numbers("x"), table.numbers("y");
        return out;
    }
    VectorXd external(const CsvTable& table) const {
        return synthetic ? table.numbers("g") : VectorXd(table.numbers("dist").cwiseSqrt());
    }
};

KrigingProblem makeProblem(const Dataset& set, const Method& method, VariogramModel model) {
    KrigingProblem problem;
    const auto n = static_cast<Index>(set.data.size());
    problem.positions = Dataset::positions(set.data);
    problem.values = set.data.numbers(set.synthetic && method.errorVariances ? "zobs" : "z");
    problem.errorVariances = VectorXd::Constant(n, method.noNugget ? 0 : method.errorShare * model.nugget);
    if (method.errorVariances) problem.errorVariances += set.data.numbers("mevar");
    model.nugget = method.noNugget ? 0 : (1 - method.errorShare) * model.nugget;
    problem.model = model;
    if (method.base == "SK") {
        problem.drift.polynomial = DriftPolynomial::None;
        problem.drift.mean = Eigen::RowVectorXd::Constant(1, set.mean);
    } else if (method.base == "UK") {
        problem.drift.polynomial = DriftPolynomial::Linear;
    } else if (method.base == "KED") {
        problem.drift.external = set.external(set.data);
    } else if (method.base != "OK" && method.base != "KM") {
        throw std::runtime_error("unknown kind of kriging " + method.base);
    }
    return problem;
}

/// Nodes and weights on a square of side 1 around 0.
std::pair<MatrixXd, VectorXd> footprint(Block block) {
    std::vector<double> node, weight;
    if (block == Block::Midpoints) {
        for (int i = 0; i < 16; ++i) node.push_back((i + 0.5) / 16 - 0.5), weight.push_back(1.0 / 16);
    } else {
        // 4-point Gauss-Legendre; gstat writes ten digits.
        double inner = std::sqrt(3.0 / 7 - 2.0 / 7 * std::sqrt(1.2));
        double outer = std::sqrt(3.0 / 7 + 2.0 / 7 * std::sqrt(1.2));
        double heavy = (18 + std::sqrt(30.0)) / 36, light = (18 - std::sqrt(30.0)) / 36;
        if (block == Block::GstatNodes) {
            for (double* x : {&inner, &outer, &heavy, &light}) *x = std::round(*x * 1e10) / 1e10;
        }
        node = {-outer / 2, -inner / 2, inner / 2, outer / 2};
        weight = {light / 2, heavy / 2, heavy / 2, light / 2};
    }
    const auto k = static_cast<Index>(node.size());
    MatrixXd offsets(k * k, 2);
    VectorXd weights(k * k);
    for (Index i = 0; i < k; ++i)
        for (Index j = 0; j < k; ++j) {
            const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
            offsets.row(i * k + j) << node[a], node[b];
            weights[i * k + j] = weight[a] * weight[b];
        }
    return {offsets, weights};
}

/// Each point from the `count` data nearest to it.
KrigingPrediction predictFromNearest(const KrigingProblem& problem, const KrigingTargets& targets,
                                     Index count) {
    KrigingPrediction all;
    all.estimate.resize(targets.count(), problem.values.cols());
    all.variance.resize(targets.count());
    for (Index t = 0; t < targets.count(); ++t) {
        const VectorXd distance =
            (problem.positions.rowwise() - targets.points.row(t)).rowwise().squaredNorm();
        std::vector<Index> chosen(static_cast<std::size_t>(distance.size()));
        std::iota(chosen.begin(), chosen.end(), Index{0});
        std::stable_sort(chosen.begin(), chosen.end(),
                         [&](Index a, Index b) { return distance[a] < distance[b]; });
        chosen.resize(std::min(chosen.size(), static_cast<std::size_t>(count)));
        KrigingProblem local = problem;
        local.positions = problem.positions(chosen, Eigen::all);
        local.values = problem.values(chosen, Eigen::all);
        if (problem.errorVariances.size() > 0) local.errorVariances = problem.errorVariances(chosen);
        KrigingTargets point;
        point.points = targets.points.row(t);
        const KrigingPrediction one = KrigingSystem(local).predict(point);
        all.estimate.row(t) = one.estimate.row(0);
        all.variance[t] = one.variance[0];
        all.status.push_back(one.status[0]);
    }
    return all;
}

KrigingPrediction predict(const Dataset& set, const Method& method, const KrigingProblem& problem) {
    KrigingTargets targets;
    targets.points = Dataset::positions(set.targets);
    const MatrixXd external = method.base == "KED" ? MatrixXd(set.external(set.targets)) : MatrixXd();
    targets.externalDrift = external;
    if (method.nearest > 0) {
        return predictFromNearest(problem, targets, method.nearest);
    }
    if (method.block != Block::None) {
        const auto [offsets, weights] = footprint(method.block);
        targets = blockTargets(targets.points, offsets * set.blockSize, weights);
        targets.externalDrift = external;
    }
    KrigingPredictOptions options;
    if (method.trend || method.base == "KM") options.quantity = KrigingQuantity::Drift;
    return KrigingSystem(problem).predict(targets, options);
}

class Comparison {
  public:
    void row(const std::string& name, double found, double wanted, double tolerance) {
        worst_ = std::max(worst_, std::abs(found - wanted) / tolerance);
        good_ &= std::abs(found - wanted) <= tolerance;
        if (std::abs(found - wanted) <= tolerance) return;
        std::cout << "FAIL  " << name << ": found " << found << ", expected " << wanted << " (off by "
                  << std::abs(found - wanted) << ", tolerance " << tolerance << ")\n";
    }
    /// Counts what was compared since the last call as one row.
    void finish() {
        ++(good_ ? count.passed : count.failed);
        good_ = true;
    }
    double worst() const { return worst_; }
    OracleCount count;

  private:
    bool good_ = true;
    double worst_ = 0;
};

using Key = std::tuple<std::string, std::string, std::string>;

Key keyOf(const CsvTable& table, std::size_t row) {
    return {table.text(row, "dataset"), table.text(row, "method"), table.text(row, "model")};
}

std::string nameOf(const Key& key) {
    return std::get<0>(key) + " " + std::get<1>(key) + " " + std::get<2>(key);
}

/// The library's answers for one dataset, method and model: one row a target or datum.
struct Answers {
    VectorXd estimate, variance;
    std::map<std::string, Index> index;  // by id
};

class Runner {
  public:
    explicit Runner(const std::string& folder) : folder_(folder), models_(folder + "/models.csv") {}

    Answers predictions(const Key& key) {
        const auto& [dataset, methodName, modelName] = key;
        const Method method = parse(methodName);
        const Dataset& set = load(dataset);
        const KrigingProblem problem = makeProblem(set, method, readModel(models_, dataset, modelName));
        const KrigingPrediction p = predict(set, method, problem);
        return answers(p.estimate.col(0), p.variance, set.targets, "tid");
    }

    Answers leaveOneOut(const Key& key) {
        const auto& [dataset, methodName, modelName] = key;
        const Dataset& set = load(dataset);
        const KrigingProblem problem =
            makeProblem(set, parse(methodName), readModel(models_, dataset, modelName));
        const LeaveOneOut loo = KrigingSystem(problem).leaveOneOut();
        return answers(loo.estimate.col(0), loo.variance, set.data, "id");
    }

  private:
    const Dataset& load(const std::string& name) {
        auto found = sets_.find(name);
        if (found == sets_.end()) found = sets_.emplace(name, Dataset(folder_, name)).first;
        return found->second;
    }

    static Answers answers(const VectorXd& estimate, const VectorXd& variance, const CsvTable& ids,
                           const std::string& column) {
        Answers out{estimate, variance, {}};
        for (std::size_t i = 0; i < ids.size(); ++i) out.index[ids.text(i, column)] = static_cast<Index>(i);
        return out;
    }

    std::string folder_;
    CsvTable models_;
    std::map<std::string, Dataset> sets_;
};

}  // namespace

OracleCount runPredictions(const std::string& dir) {
    Runner runner(dir);
    Comparison comparison;
    std::map<Key, std::optional<Answers>> cache;
    const auto lookUp = [&](const Key& key, const auto& compute) -> const std::optional<Answers>& {
        auto found = cache.find(key);
        if (found == cache.end()) {
            std::optional<Answers> answers;
            try {
                answers = compute(key);
            } catch (const std::exception& error) {
                std::cout << "FAIL  " << nameOf(key) << ": " << error.what() << '\n';
            }
            found = cache.emplace(key, std::move(answers)).first;
        }
        return found->second;
    };
    const auto check = [&](const CsvTable& table, const std::string& id, const auto& compute) {
        cache.clear();
        for (std::size_t i = 0; i < table.size(); ++i) {
            const Key key = keyOf(table, i);
            const std::optional<Answers>& answers = lookUp(key, compute);
            if (!answers || !answers->index.count(table.text(i, id))) {
                ++comparison.count.failed;
                continue;
            }
            const Index at = answers->index.at(table.text(i, id));
            const double estimate = table.number(i, "pred"), variance = table.number(i, "var");
            // Far targets under a linear drift are extrapolated to 1e6 times the data's extent.
            // gstat's block nodes are known to ten digits only.
            const double relative = parse(std::get<1>(key)).block == Block::GstatNodes ? 1e-7 : 1e-10;
            const std::string name = nameOf(key) + " " + table.text(i, id);
            comparison.row(name, answers->estimate[at], estimate,
                           relative * std::max(1.0, std::abs(estimate)));
            comparison.row(name + " variance", answers->variance[at], std::max(0.0, variance),
                           relative * std::max(1.0, variance));
            if (table.has("zscore")) {
                const double residual = table.number(i, "observed") - answers->estimate[at];
                comparison.row(name + " residual", residual, table.number(i, "residual"), 1e-10);
                comparison.row(name + " zscore", residual / std::sqrt(answers->variance[at]),
                               table.number(i, "zscore"), 1e-9);
            }
            comparison.finish();
        }
    };
    const std::string predictions = dir + "/predictions_exact.csv", loo = dir + "/loo_exact.csv";
    if (std::filesystem::exists(predictions))
        check(CsvTable(predictions), "tid", [&](const Key& key) { return runner.predictions(key); });
    if (std::filesystem::exists(loo))
        check(CsvTable(loo), "id", [&](const Key& key) { return runner.leaveOneOut(key); });
    std::cout << "predictions and leave-one-out: worst error " << comparison.worst() << " of its tolerance\n";
    return comparison.count;
}
