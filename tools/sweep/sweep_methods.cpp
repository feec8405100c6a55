#include <algorithm>
#include <sstream>

#include "sweep/sweep.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx {

const std::vector<SweepMethod>& builtInMethods() {
    // What a new method of vlx-krige needs is a line here.
    static const std::string krige = "vlx-krige {input} -o {output} --threads {threads} --json ";
    static const std::vector<SweepMethod> methods = {
        {.name = "mean", .command = krige + "--method mean", .hierarchical = true, .tracersOwn = true},
        {.name = "gaussian", .command = krige + "--method gaussian --sigma {sigma}"},
        {.name = "paper", .command = krige + "--method paper", .hierarchical = true, .inspectable = true},
        {.name = "krige-draft", .command = krige + "--method krige --quality draft"},
        {.name = "krige-standard",
         .command = krige + "--method krige --quality standard",
         .hierarchical = true,
         .inspectable = true},
        {.name = "krige-high", .command = krige + "--method krige --quality high"},
        {.name = "krige-temporal", .command = krige + "--method krige --temporal 2", .ofSequences = true},
    };
    return methods;
}

const std::vector<std::string>& builtInVariations() {
    static const std::vector<std::string> variations = {"paper --region 2,6", "paper --no-colour-distance"};
    return variations;
}

std::vector<SweepMethod> expandVariation(const std::vector<SweepMethod>& methods, const std::string& text) {
    std::istringstream words(text);
    std::string name, option, values, more;
    words >> name >> option >> values;
    if (!option.starts_with("-") || words >> more)
        throw Error(text, "expected METHOD --option VALUE,VALUE,... or METHOD --flag");
    const auto method =
        std::find_if(methods.begin(), methods.end(), [&](const SweepMethod& m) { return m.name == name; });
    if (method == methods.end()) {
        std::vector<std::string> all;
        for (const SweepMethod& m : methods) all.push_back(m.name);
        throw Error(text, "expected a method of the sweep (" + listed(all) + "), found '" + name + "'");
    }
    const auto varied = [&](const std::string& options) {
        SweepMethod variation = *method;
        variation.name += " " + options;
        variation.command += " " + options;
        variation.knob = name + " " + option;
        variation.hierarchical = variation.inspectable = variation.tracersOwn = false;
        return variation;
    };
    if (values.empty()) return {varied(option)};
    std::vector<SweepMethod> result;
    for (const std::string& value : split(values, ',')) {
        if (value.empty()) throw Error(text, "expected values separated by single commas");
        result.push_back(varied(option + " " + value));
    }
    return result;
}

SweepMethod parseExternal(const std::string& text) {
    const std::size_t sign = text.find('=');
    if (sign == 0 || sign == std::string::npos || sign + 1 == text.size())
        throw Error(text, "expected NAME=COMMAND");
    SweepMethod method{.name = text.substr(0, sign), .command = text.substr(sign + 1)};
    for (const char* place : {"{input}", "{output}"})
        if (method.command.find(place) == std::string::npos)
            throw Error(text, std::string("expected ") + place + " in the command");
    return method;
}

}  // namespace vlx
