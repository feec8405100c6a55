#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "import/moments.h"

/// Options of images by other renderers, the same in vlx-pack and vlx-krige.
namespace vlx {

/// "--map NAME=SOURCE", "NAME=FACTOR*SOURCE". Throws CLI::ValidationError.
ChannelMap parseMappings(const std::vector<std::string>& mappings);
void bindMap(CLI::App& app, std::vector<std::string>& mappings);

/// --layer, where R, G, B are.
void bindLayer(CLI::App& app, std::string& layer);

/// --albedo, --normal, --depth.
void bindCompanions(CLI::App& app, CompanionImages& with);

/// --samples of an image of moments.
void bindSamples(CLI::App& app, double& samples);

/// An image that has a variance for each pixel: --preset, --variance-is, --variance-of, --variance,
/// companions, --samples, --layer, --map.
class MomentFlags {
  public:
    void bind(CLI::App& app, const std::string& group = "Options");
    /// What was chosen, with the mappings.
    MomentOptions options() const;
    /// The files named besides the image itself; empty names for none.
    std::vector<std::string> files() const;
    std::vector<std::string*> fileNames();

  private:
    enum class Meaning { Preset, Sample, Mean, Second };
    enum class Colours { Preset, Rgb, Xyz };

    MomentOptions options_;
    Meaning meaning_ = Meaning::Preset;
    Colours colours_ = Colours::Preset;
    std::vector<std::string> mappings_;
};

/// What an importer did, line by line.
std::string toText(const ImportReport& report);

}  // namespace vlx
