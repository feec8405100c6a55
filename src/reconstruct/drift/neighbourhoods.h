#pragma once

#include <cstdint>
#include <vector>

#include "reconstruct/data/pixel_data.h"
#include "reconstruct/drift/patch_similarity.h"

/// Kriging in overlapping neighbourhoods: the estimates of one tile's centres, added to the pixels they
/// reach.
namespace vlx {

/// How far a neighbourhood reaches and how unlike its patches may be (drift.h, 3 and 5).
struct NeighbourhoodModel {
    int reach = 8;          ///< pixels along each axis, at most kMaxReach
    float tolerance = 1;    ///< k of w = exp(-d / k^2)
    int stride = 4;         ///< a centre every so many pixels, at most 8
    bool features = false;  ///< unlike features weigh a datum down as well
    /// Centres that are not regular cover others. Not where much is alike: a pixel beside a lamp needs its
    /// own.
    bool ownCover = true;
};

struct TileInput {
    const RowRing* data = nullptr;       ///< DataPlanes
    const RowRing* features = nullptr;   ///< FeaturePlanes
    const RowRing* variances = nullptr;  ///< VariancePlanes
    DataPlanes planes;
    int featureCount = 0;
    std::vector<int> group;  ///< of each feature
    int groups = 0;
    int width = 0, height = 0;  ///< of the image
    std::int64_t number = 0;  ///< another for other data: what a thread holds of them it does not load again
};

struct NeighbourhoodCounts {
    std::int64_t neighbourhoods = 0;
    std::int64_t own = 0;       ///< centred on a pixel that no regular one fits
    std::int64_t failed = 0;    ///< equations not solvable: the neighbourhood's weighted mean
    std::int64_t features = 0;  ///< sum of numbers of features that vary in the neighbourhood: the others are
                                ///< no drift there
    double effective = 0;       ///< sum of effective numbers of drift functions
};

/// All neighbourhoods of one half centred in the tile at (x, y), of all models. estimates[m] takes the sums
/// of model m, over the tile and kMaxReach around it: halves, and tiles 2 kTile apart, may run at the same
/// time.
NeighbourhoodCounts krigeTile(const TileInput& input, const std::vector<NeighbourhoodModel>& models, int x,
                              int y, int half, std::vector<RowRing>& estimates);

}  // namespace vlx
