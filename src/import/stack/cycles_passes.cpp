#include "import/stack/cycles_passes.h"

#include <algorithm>

#include "exr/flat_images.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

struct Ending {
    const char* name;    // of the contribution
    const char* prefix;  // of its passes
    bool coloured;       // divided by a colour
};
constexpr Ending kEndings[] = {{"Diffuse", "Diff", true},
                               {"Glossy", "Gloss", true},
                               {"Transmission", "Trans", true},
                               {"Volume", "Volume", false}};
constexpr const char* kWhole[] = {"Emit", "Env"};
constexpr const char kColours[] = {'R', 'G', 'B'};

bool hasPass(const Names& names, const std::string& layer, const std::string& pass) {
    return contains(names, layer + pass + ".R");
}

}  // namespace

std::string toText(const Recipe& recipe) {
    const std::string sum = listed(recipe.sum, " + ");
    if (recipe.times.empty()) return sum;
    return (recipe.sum.size() > 1 ? "(" + sum + ")" : sum) + " * " + recipe.times;
}

Names lightGroups(const Names& names, const std::string& layer) {
    Names groups;
    const std::string prefix = layer + "Combined_";
    for (const std::string& name : names)
        if (name.starts_with(prefix) && name.ends_with(".R") && name.size() > prefix.size() + 2)
            groups.push_back(name.substr(0, name.size() - 2));
    return groups;
}

std::vector<Contribution> contributions(const Names& names, const std::string& layer) {
    std::vector<Contribution> found;
    for (const Ending& ending : kEndings) {
        const std::string prefix = ending.prefix;
        Names parts;
        for (const char* part : {"Dir", "Ind"})
            if (hasPass(names, layer, prefix + part)) parts.push_back(layer + prefix + part);
        if (parts.empty() || (ending.coloured && !hasPass(names, layer, prefix + "Col"))) continue;
        Contribution& made = found.emplace_back(Contribution{layer + ending.name, {}});
        for (std::size_t c = 0; c < 3; ++c) {
            const std::string end = std::string(".") + kColours[c];
            for (const std::string& part : parts) made.colours[c].sum.push_back(part + end);
            if (ending.coloured) made.colours[c].times = layer + prefix + "Col" + end;
        }
    }
    for (const std::string pass : kWhole) {
        if (!hasPass(names, layer, pass)) continue;
        Contribution& made = found.emplace_back(Contribution{layer + pass, {}});
        for (std::size_t c = 0; c < 3; ++c)
            made.colours[c].sum = {made.name + std::string(".") + kColours[c]};
    }
    return found;
}

Names missingContributions(const Names& names, const std::string& layer) {
    Names missing;
    const auto need = [&](const std::string& pass) {
        if (!hasPass(names, layer, pass)) missing.push_back(pass);
    };
    for (const Ending& ending : kEndings)
        for (const char* part : {"Dir", "Ind", "Col"})
            if (ending.coloured || std::string(part) != "Col") need(std::string(ending.prefix) + part);
    for (const char* pass : kWhole) need(pass);
    return missing;
}

std::string passOf(const std::string& channel) {
    const std::string pass = channel.substr(0, channel.find_last_of('.'));
    return pass.substr(pass.find_last_of('.') + 1);  // npos + 1: all of it
}

PassKind passKind(const std::string& channel) {
    const std::string pass = passOf(channel);
    if (pass == "Depth" || pass == "Position" || pass == "IndexOB" || pass == "IndexMA")
        return PassKind::FirstSample;
    return pass == "Vector" ? PassKind::MeanOfHits : PassKind::Mean;
}

}  // namespace vlx
