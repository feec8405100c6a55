#include <algorithm>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "hard_case.h"

namespace vlx::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using nlohmann::json;

double number(const json& value) {
    if (value.is_number()) return value.get<double>();
    const auto text = value.get<std::string>();
    if (text == "NaN") return std::numeric_limits<double>::quiet_NaN();
    if (text == "Infinity") return std::numeric_limits<double>::infinity();
    if (text == "-Infinity") return -std::numeric_limits<double>::infinity();
    throw std::runtime_error("not a number: " + text);
}

VectorXd numbers(const json& values) {
    VectorXd out(static_cast<Index>(values.size()));
    Index i = 0;
    for (const json& value : values) out[i++] = number(value);
    return out;
}

/// One inner list a row.
MatrixXd rows(const json& lists) {
    MatrixXd out;
    Index i = 0;
    for (const json& list : lists) {
        const VectorXd row = numbers(list);
        if (i == 0) out.resize(static_cast<Index>(lists.size()), row.size());
        out.row(i++) = row.transpose();
    }
    return out;
}

StructureType structureType(const std::string& name) {
    static const std::map<std::string, StructureType> types = {
        {"spherical", StructureType::Spherical}, {"exponential", StructureType::Exponential},
        {"gaussian", StructureType::Gaussian},   {"stable", StructureType::Stable},
        {"matern", StructureType::Matern},       {"linear", StructureType::Linear}};
    return types.at(name);
}

VariogramModel model(const json& j) {
    VariogramModel out;
    out.nugget = number(j.at("nugget"));
    for (const json& s : j.at("structures")) {
        VariogramStructure structure;
        structure.type = structureType(s.at("type").get<std::string>());
        structure.sill = number(s.at("sill"));
        structure.range = number(s.at("range"));
        for (const char* name : {"alpha", "kappa", "nu", "shape"})
            if (s.contains(name)) structure.shape = number(s.at(name));
        out.structures.push_back(structure);
    }
    return out;
}

MatrixXd positions(const json& j) {
    const VectorXd x = numbers(j.at("x")), y = numbers(j.at("y"));
    MatrixXd out(x.size(), 2);
    out << x, y;
    return out;
}

}  // namespace

bool HardCase::has(const std::string& property) const {
    return std::find(properties.begin(), properties.end(), property) != properties.end();
}

HardCase readHardCase(const std::string& path) {
    std::ifstream file(path);
    const json j = json::parse(file);
    HardCase out;
    out.id = j.at("id").get<std::string>();
    KrigingProblem& problem = out.problem;
    problem.model = model(j.at("model"));
    problem.positions = positions(j.at("data"));
    problem.values = numbers(j.at("data").at("z"));
    out.targets.points = positions(j.at("targets"));

    const Index n = problem.positions.rows();
    problem.errorVariances = VectorXd::Constant(n, number(j.at("model").value("error_nugget", json(0.0))));
    if (j.at("data").contains("mevar")) problem.errorVariances += numbers(j.at("data").at("mevar"));

    const std::string kind = j.at("kriging").get<std::string>();
    const std::string drift =
        j.contains("drift") && j["drift"].is_string() ? j["drift"].get<std::string>() : "1";
    if (kind == "simple") {
        problem.drift.polynomial = DriftPolynomial::None;
        problem.drift.mean = Eigen::RowVectorXd::Constant(1, number(j.at("mean")));
    } else if (drift == "columns") {
        problem.drift.polynomial = DriftPolynomial::None;
        problem.drift.external = rows(j.at("data").at("drift")).transpose();
        out.targets.externalDrift = rows(j.at("targets").at("drift")).transpose();
    } else if (drift == "1,x,y") {
        problem.drift.polynomial = DriftPolynomial::Linear;
    } else if (drift == "quadratic") {
        problem.drift.polynomial = DriftPolynomial::Quadratic;
    } else if (drift != "1") {
        throw std::runtime_error("unknown drift " + drift);
    }
    if (j.contains("extra_target")) {
        const Index m = out.targets.points.rows();
        out.targets.points.conservativeResize(m + 1, 2);
        out.targets.points.row(m) = numbers(j["extra_target"]).transpose();
        if (out.targets.externalDrift.rows() == m) {
            out.targets.externalDrift.conservativeResize(m + 1, Eigen::NoChange);
            out.targets.externalDrift.row(m).setOnes();
        }
        out.extraTargetIsInvalid = !out.targets.points.row(m).allFinite();
    }

    const json& expect = j.at("expect");
    out.status = expect.at("status").get<std::string>();
    if (expect.contains("prediction")) out.prediction = numbers(expect["prediction"]);
    if (expect.contains("variance")) out.variance = numbers(expect["variance"]);
    if (expect.contains("weights")) out.weights = rows(expect["weights"]);
    if (expect.contains("beta") && expect["beta"].is_array()) out.beta = numbers(expect["beta"]);
    if (expect.contains("beta_variance") && expect["beta_variance"].is_array() &&
        std::none_of(expect["beta_variance"].begin(), expect["beta_variance"].end(),
                     [](const json& v) { return v.is_array(); }))
        out.betaVariance = numbers(expect["beta_variance"]);
    for (const auto& [name, value] : expect.at("tolerance").items())
        if (!value.is_object()) out.tolerance[name] = number(value);
    for (const json& property : expect.at("properties"))
        out.properties.push_back(property.get<std::string>());
    out.condition = std::numeric_limits<double>::infinity();
    if (j.contains("cond_double_estimate") && !j["cond_double_estimate"].is_null())
        out.condition = number(j["cond_double_estimate"]);
    return out;
}

}  // namespace vlx::testing
