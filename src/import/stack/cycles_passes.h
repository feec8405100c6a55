#pragma once

#include <array>
#include <string>
#include <vector>

#include "import/channel_presets.h"

/// What the passes of Blender's multilayer files are: channels "L.PASS.C" of a layer L. `layer` is
/// cyclesLayer(): "L." with its dot.
namespace vlx {

/// What a channel of the dump is made of in each image: the sum of some channels, times another one.
struct Recipe {
    Names sum;
    std::string times = {};  ///< empty: 1
};
/// "(L.DiffDir.R + L.DiffInd.R) * L.DiffCol.R".
std::string toText(const Recipe& recipe);

/// A part of the light by what it did last: three colours, under the name of a layer.
struct Contribution {
    std::string name;  ///< "L.Diffuse"
    std::array<Recipe, 3> colours;
};

/// The layers "L.Combined_NAME" of light groups.
Names lightGroups(const Names& names, const std::string& layer);

/// What adds up to the Combined pass: L.Diffuse = (DiffDir + DiffInd) * DiffCol, L.Glossy and L.Transmission
/// in the same way, L.Volume = VolumeDir + VolumeInd, and the passes L.Emit and L.Env. Those that the names
/// have no passes of are left out.
std::vector<Contribution> contributions(const Names& names, const std::string& layer);
/// Passes that are needed for all of them and that the names lack.
Names missingContributions(const Names& names, const std::string& layer);

/// How several images' values of a pass become one.
enum class PassKind {
    Mean,         ///< as more samples would
    FirstSample,  ///< Cycles records it of its sample 0 alone: of the first image that has it in the pixel
    MeanOfHits,   ///< vectors, which are 0 where nothing was hit: the mean of the others
};
PassKind passKind(const std::string& channel);
/// "PASS" of "L.PASS.C".
std::string passOf(const std::string& channel);

}  // namespace vlx
