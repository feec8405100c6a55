#include "import/stack/notes.h"

#include <set>

#include "variolux/base/text.h"

namespace vlx {

namespace {

// Parts of the light that differ from it by more than that do not add up: rounding is 1e-7 of floats, 3e-4 of
// half floats.
constexpr double kMostOff = 1e-5, kMostOffOfHalf = 1e-3;

}  // namespace

void noteMotion(const ChannelMap& map, std::int64_t unknown, std::vector<std::string>& notes) {
    std::vector<std::string> missing;
    for (const std::string_view name : kMotionChannels)
        if (!map.contains(std::string(name))) missing.emplace_back(name);
    if (missing.size() == std::size(kMotionChannels)) return;
    if (!missing.empty())
        notes.push_back("The images say nothing about " + listed(missing) + ": not known (NaN) anywhere.");
    if (unknown > 0)
        notes.push_back("The motion of " + std::to_string(unknown) +
                        " samples is not known: Cycles leaves out what is no surface.");
}

void notePreset(const StackPlan& plan, std::vector<std::string>& notes) {
    if (plan.noisyImage)
        notes.push_back("Combined is denoised: R, G, B and A are from Noisy Image, the samples' mean.");
    if (plan.preset == StackPreset::Cycles && plan.mapped.contains("N.X"))
        notes.push_back(
            "Normals are taken as they are: Cycles' denoising normals are in camera space and "
            "may be shorter than 1.");
    if (plan.preset == StackPreset::Pbrt && !plan.mapped.contains("Z"))
        notes.push_back(
            "pbrt's gbuffer has positions, no distances: with its default coordinates, camera space, "
            "--map Z=P.Z takes the depth along the axis.");
    if (plan.preset == StackPreset::Mitsuba)
        notes.push_back(
            "Mitsuba's filters give a sample to several pixels: only a box filter of one keeps pixels "
            "independent.");
}

void noteSamples(const std::vector<double>& ofImages, std::vector<std::string>& notes) {
    const std::set<double> kinds(ofImages.begin(), ofImages.end());
    const std::string each = kinds.size() == 1 && *kinds.begin() > 0
                                 ? " of " + formatted("%g", *kinds.begin()) +
                                       (*kinds.begin() == 1 ? " sample each" : " samples each")
                                 : "";
    notes.push_back(std::to_string(ofImages.size()) + (ofImages.size() == 1 ? " image" : " images") + each +
                    ": each image is one sample a pixel and one replicate, in the order given.");
    if (kinds.size() < 2) return;
    Names numbers;
    for (const double kind : kinds) numbers.push_back(kind > 0 ? formatted("%g", kind) : "unknown");
    notes.push_back("WARNING: the images are means of different numbers of samples (" + listed(numbers) +
                    "), but count alike: render images of equally many.");
}

void noteSum(const std::string& what, const LightSum& sum, bool half, const std::string& advice,
             std::vector<std::string>& notes) {
    const std::string off = formatted("%.1e", sum.difference());
    if (sum.difference() <= (half ? kMostOffOfHalf : kMostOff))
        notes.push_back(what + " add up to the light (" + off + " of it off" +
                        (half ? ", as half floats round it: 32-bit files are more exact)." : ")."));
    else
        notes.push_back("WARNING: " + what +
                        " do not add up to the light: " + formatted("%.2g %%", 100 * sum.missing()) +
                        " of it is in none of them (" + off + " of it off)." + advice);
}

void noteRadiance(const StackPlan& plan, std::vector<std::string>& notes) {
    if (plan.groups.empty() && plan.contributions.empty()) return;
    std::string options;
    for (const std::string& name : plan.radiance) options += " --radiance '" + name + "'";
    notes.push_back("For vlx-krige:" + options);
}

}  // namespace vlx
